"""Which surfaces `reproduce` measures: models from a server on this machine, and stand-ins."""

import hashlib
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.api import paper_surfaces
from cembench.api.paper_surfaces import fetch_models, make_stand_ins, public_models
from cembench.mesh.datasets import Dataset, is_fetched
from cembench.registry import load_registry
from tests.models_server import ModelsServer, content_of

#: Two that take a second each.
SMALL = ("nefertiti-stand-in", "cowboy-hat-stand-in")


@pytest.fixture
def server(monkeypatch, tmp_path):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    with ModelsServer() as server:
        monkeypatch.setenv("CEMBENCH_DATA_URL", server.url)
        yield server


def models(*names):
    def model(name):
        content = content_of(name)
        checksum = hashlib.sha256(content).hexdigest()
        url = f"https://example.org/{name}.obj"
        return Dataset(name, name, url, checksum, "MIT", len(content))

    return [model(name) for name in names]


def test_all_are_fetched_and_the_next_time_no_server_is_asked(server):
    wanted = models("nefertiti", "cowboy-hat")
    assert fetch_models(wanted) == "fetched 2 of the paper's models"
    assert all(map(is_fetched, wanted))
    assert fetch_models(wanted) == "2 of the paper's models are here, fetched before"
    assert server.asked == 2


def test_each_that_cannot_be_fetched_is_counted_with_the_reason(server):
    (here,) = models("nefertiti")
    fetch_models([here])
    message = fetch_models([here, *models("cowboy-hat", "missing")])
    assert message == (
        "fetched 1 of the paper's models (1 fetched before); 1 could not be reached "
        "(HTTPError): stand-ins are measured"
    )


@pytest.mark.parametrize(
    ("way", "why"),
    [
        ("hangs", "not complete within 0.5 s"),
        ("trickles", "not complete within 0.5 s"),
        ("lies", "the server has another file"),
        ("sends-more", "the server sends"),
    ],
)
def test_a_bad_server_costs_no_more_than_the_time_and_stand_ins_are_measured(server, way, why):
    """The server of the first two goes on until the end of the test."""
    wanted = models(f"{way}-1", f"{way}-2")
    message = fetch_models(wanted, seconds=0.5)
    assert message.startswith("the paper's models could not be reached (")
    assert why in message
    assert message.endswith("): stand-ins are measured")
    assert not any(map(is_fetched, wanted))
    assert not server.released.is_set()


def test_without_a_server(server, monkeypatch):
    monkeypatch.setenv("CEMBENCH_DATA_URL", "http://127.0.0.1:9")
    assert "(ConnectionError): stand-ins are measured" in fetch_models(models("nefertiti"))


def test_a_cache_that_cannot_be_written_to(server, tmp_path):
    (tmp_path / "cache").write_text("in the way")
    assert "(the cache cannot be written to)" in fetch_models(models("nefertiti"))


def test_the_public_models_are_those_of_the_registry_in_these_rows():
    registry = load_registry()
    found = {one.paper_row for one in public_models(registry, ["Nefertiti", "Foot", "Left Hand"])}
    assert found == {"Nefertiti", "Left Hand"}


def test_stand_ins_made_side_by_side_have_the_same_bytes(tmp_path, monkeypatch):
    registry, found, told = load_registry(), {}, []
    for jobs in (1, 2):
        monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / str(jobs)))
        made = make_stand_ins(registry, SMALL, jobs, lambda *words: told.append(words))
        files = (tmp_path / str(jobs) / "surfaces").iterdir()
        found[jobs] = {file.name: file.read_bytes() for file in files}
        assert [mesh.name for mesh in made] == list(SMALL)
        assert len(found[jobs]) == 2
    assert found[1] == found[2]
    assert {name for name, _, _ in told} == set(SMALL)
    assert [counts for _, *counts in told] == [[1, 2], [2, 2]] * 2
    # What is in the cache is not made again.
    monkeypatch.setattr(paper_surfaces, "process_pool", None)
    again = make_stand_ins(registry, SMALL, 2, lambda *words: told.append(words))
    assert [mesh.hash for mesh in again] == [mesh.hash for mesh in made]
    assert len(told) == 4


def test_where_a_process_is_killed_the_rest_is_made_one_after_the_other(tmp_path, monkeypatch):
    @contextmanager
    def broken(*_):
        raise BrokenProcessPool
        yield

    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(paper_surfaces, "process_pool", broken)
    made = lambda registry, name: flat_disk(60).renamed(name)  # noqa: E731
    monkeypatch.setattr(paper_surfaces, "generate_surface", made)
    collected = []
    made = make_stand_ins(load_registry(), SMALL, 2, lambda *words: collected.append(words))
    assert [mesh.name for mesh in made] == list(SMALL)
    assert [counts for _, *counts in collected] == [[1, 2], [2, 2]]
