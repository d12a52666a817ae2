"""Fetching, against a server on this machine."""

from __future__ import annotations

import hashlib
import io
import json
import re
import threading
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.disk_grid import disk_grid
from requests.adapters import HTTPAdapter
from rich.console import Console
from scipy.io import savemat

import cembench
from cembench import registry
from cembench.commands import console
from cembench.core.errors import DatasetError, RecordError, RegistryError
from cembench.mesh.datasets import Dataset, fetch, is_fetched
from cembench.mesh.files import read_mesh, write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from cembench.running.plan import Provenance, provenance_of
from tests.limits import files_of_at_most, tree
from tests.real_meshes import real_mesh

pytestmark = pytest.mark.process


def _mat():
    z, F = disk_grid(100)
    file = io.BytesIO()
    savemat(file, {"v": np.stack([z.real, z.imag, 0 * z.real], axis=1), "f": F + 1})
    return file.getvalue()


class Server:
    """What the server answers, and how often it was asked."""

    def __init__(self) -> None:
        self.content = _mat()
        self.promised = len(self.content)
        self.requests = 0
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                outer.requests += 1
                self.send_response(200 if self.path == "/tiny.mat" else 404)
                self.send_header("Content-Length", str(outer.promised))
                self.end_headers()
                self.wfile.write(outer.content)

            def log_message(self, *_: object) -> None:
                pass

        self.http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.http.server_port}"


@pytest.fixture
def server(monkeypatch, tmp_path):
    server = Server()
    thread = threading.Thread(target=server.http.serve_forever, daemon=True)
    thread.start()
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("CEMBENCH_DATA_URL", server.url)
    answers, send = [], HTTPAdapter.send

    def kept(*given, **settings):
        answers.append(send(*given, **settings))
        return answers[-1]

    monkeypatch.setattr(HTTPAdapter, "send", kept)
    yield server
    assert all(answer.raw.closed for answer in answers), "a connection is left to the collector"
    server.http.shutdown()
    server.http.server_close()
    thread.join()


@pytest.fixture
def tiny(server):
    checksum = hashlib.sha256(server.content).hexdigest()
    return Dataset(
        "tiny", "Tiny", "https://example.org/tiny.mat", checksum, "MIT", paper_row="Nefertiti"
    )


@pytest.fixture
def known(tiny, server, monkeypatch, tmp_path):
    """The command line knows of this dataset, and of one that its server has not."""
    absent = replace(tiny, name="absent", source_url="https://example.org/absent.mat")
    published = tmp_path / "published.mat"
    published.write_bytes(server.content)
    tiny = replace(tiny, mesh_hash=read_mesh(published).hash)
    installed = replace(load_registry(), datasets={"tiny": tiny, "absent": absent})
    monkeypatch.setattr(registry, "_installed", lambda: installed)


def test_good_file(server, tiny):
    assert not is_fetched(tiny)
    mesh = read_mesh(fetch(tiny))
    assert (mesh.m, mesh.name) == (96, "tiny")
    assert is_fetched(tiny)


def test_cache_hit_asks_no_server(server, tiny):
    first = fetch(tiny)
    assert fetch(tiny) == first
    assert server.requests == 1


def test_damaged_file_in_the_cache_is_fetched_anew(server, tiny):
    fetch(tiny).write_bytes(server.content[:100])
    assert fetch(tiny).read_bytes() == server.content
    assert server.requests == 2


def test_wrong_checksum(server, tiny):
    server.content = bytes(len(server.content))
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127.*SHA-256"):
        fetch(tiny)
    assert not tiny.path.exists()


def test_truncated_download(server, tiny):
    server.content = server.content[:200]
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127"):
        fetch(tiny)
    assert not tiny.path.exists()


def test_server_down(tiny, monkeypatch):
    monkeypatch.setenv("CEMBENCH_DATA_URL", "http://127.0.0.1:9/")
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127.0.0.1:9/tiny\.mat.*mirror"):
        fetch(tiny, timeout=2)


def test_missing_on_the_mirror(server, tiny, monkeypatch):
    monkeypatch.setenv("CEMBENCH_DATA_URL", server.url + "/elsewhere")
    with pytest.raises(DatasetError, match="404"):
        fetch(tiny)


def test_cache_that_is_no_folder(tiny, tmp_path):
    (tmp_path / "cache").write_text("in the way")
    with pytest.raises(RecordError, match=r"cannot keep tiny\.mat .* CEMBENCH_CACHE"):
        fetch(tiny)


def test_a_full_disk_leaves_what_was_there_and_ends_with_2(cli, server, tiny, known):
    tiny.path.parent.mkdir(parents=True)
    tiny.path.write_bytes(b"older")
    with files_of_at_most(1000):
        code, out, err = cli("fetch", "tiny")
    assert (code, out) == (2, "")
    assert "cannot be written: File too large. Free some space" in err
    assert tree(tiny.path.parent) == {Path("tiny.mat"): b"older"}
    assert fetch(tiny).read_bytes() == server.content


def test_progress_is_told_of_every_byte(server, tiny):
    class Bar:
        total, done, closed = 0, 0, False

        def update(self, count):
            self.done += count

        def close(self):
            self.closed = True

    bar = Bar()
    fetch(tiny, progress=bar)
    assert (bar.total, bar.done, bar.closed) == (len(server.content), len(server.content), True)


def test_seven_of_those_that_are_known_are_models_of_the_paper():
    known = load_registry().datasets
    assert {name: d.paper_row for name, d in known.items() if d.paper_row} == {
        "nefertiti": "Nefertiti",
        "cowboy-hat": "Cowboy Hat",
        "chinese-lion": "Chinese Lion",
        "david-head": "David Head",
        "stanford-bunny": "Stanford Bunny",
        "human-brain": "Human Brain",
        "left-hand": "Left Hand",
    }
    with pytest.raises(
        RegistryError, match="unknown dataset 'teapot'; known: airplane, alex-3holes, "
    ):
        load_registry().dataset("teapot")


def test_a_model_is_recognised_by_its_mesh_in_any_file(tiny, known, server, tmp_path):
    path = tmp_path / "renamed.mat"
    path.write_bytes(server.content)
    mesh = read_mesh(path)
    write_mesh(tmp_path / "other.ply", mesh)
    for file in (path, tmp_path / "other.ply"):
        provenance = provenance_of(load_registry(), read_mesh(file))
        assert provenance == Provenance("Nefertiti", "model")
    unknown = replace(load_registry(), datasets={"tiny": tiny})
    assert provenance_of(unknown, mesh) == Provenance()


@pytest.mark.parametrize("name", ["chinese_lion.mat", "chinese_lion.obj"])
def test_the_chinese_lion_is_recognised_in_either_format(name):
    path = real_mesh(name)
    provenance = provenance_of(load_registry(), read_mesh(path, TriangleMesh))
    source = "garyptchoi/disk-conformal-map"
    assert provenance == Provenance("Chinese Lion", "model", source, "chinese-lion")


def test_fetch_lists_what_there_is(cli, known):
    code, out, _ = cli("fetch")
    assert code == 0
    assert "absent" in out
    listed = json.loads(cli("fetch", "--json")[1])
    assert all(about["url"].startswith("http://127.0.0.1") for about in listed)
    assert [(about["name"], about["fetched"]) for about in listed] == [
        ("tiny", False),
        ("absent", False),
    ]
    cli("fetch", "tiny")
    assert [about["fetched"] for about in json.loads(cli("fetch", "--json")[1])] == [True, False]


def test_the_list_fits_into_80_columns(cli):
    assert max(map(len, cli("fetch")[1].splitlines())) <= 80


def test_fetch_says_where_the_file_is(cli, known, tiny):
    code, out, _ = cli("fetch", "tiny")
    assert (code, out) == (0, f"tiny: {tiny.path}\n")
    (about,) = json.loads(cli("fetch", "tiny", "--json")[1])
    assert about["path"] == str(tiny.path)
    assert about["size"] == tiny.path.stat().st_size
    assert about["paper_row"] == "Nefertiti"


def test_a_bar_shows_on_a_terminal(known, tiny, monkeypatch):
    terminal = Console(force_terminal=True, width=80, file=io.StringIO())
    monkeypatch.setattr(console, "err", terminal)
    cembench.fetch("tiny", reporter=console.SHOWN)
    assert is_fetched(tiny)
    shown = terminal.file.getvalue()
    assert "fetching tiny" in shown
    assert re.search(r"[\d.]+/[\d.]+ kB", shown)


def test_fetch_goes_on_after_a_failure_and_exits_with_1(cli, known):
    code, out, err = cli("fetch", "absent", "tiny", "--json")
    assert code == 1
    assert "cannot fetch absent.mat" in err
    assert ["error" in about for about in json.loads(out)] == [True, False]


def test_fetch_of_an_unknown_name_fetches_nothing(cli, known, server):
    code, _, err = cli("fetch", "tiny", "teapot")
    assert code == 2
    assert "unknown dataset 'teapot'; known: absent, tiny" in err
    assert server.requests == 0


def test_map_takes_the_name_of_a_dataset(cli, known, server):
    code, out, _ = cli("map", "tiny", "--json")
    assert code == 0
    data = json.loads(out)
    assert (data["origin"], data["paper_row"]) == ("model", "Nefertiti")
    shown = " ".join(cli("map", "tiny", "-a", "cem")[1].split())
    assert "it is Nefertiti; printed: E_C 0.0278, mean angle error 2.65" in shown
    assert server.requests == 1


def test_run_measures_a_dataset_as_the_papers_model(cli, known):
    cli("fetch", "tiny")
    arguments = ("run", "--dataset", "tiny", "-a", "harmonic-circle", "--repeats", 1, "--json")
    code, out, _ = cli(*arguments, "-o", "a")
    assert code == 0
    (row,) = json.loads(out)
    assert (row["mesh"], row["origin"], row["paper_row"]) == ("tiny", "model", "Nefertiti")
