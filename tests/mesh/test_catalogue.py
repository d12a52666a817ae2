"""The catalogue of real meshes, and fetching a group of 48 files of which some are bad."""

from __future__ import annotations

import hashlib
import json
import threading
from collections import Counter
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from cembench.surfaces.datasets import ICT_FACE, OWN, REAL_MESHES, read_datasets
from cembench.surfaces.ict_model import read_small

from cembench import registry
from cembench.core.errors import RegistryError
from cembench.mesh import datasets as wholeness
from cembench.mesh.datasets import Dataset, fetch, fetch_all, is_fetched, surface_file
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from tests.real_meshes import real_mesh

GROUPS = {
    "paper": 7,
    "disks": 24,
    "holes": 16,
    "closed": 5,
    "stress": 5,
    "corpus": 141,
    "expressions": 8,
}


def test_the_catalogue_has_201_checksums_and_5_meshes_known_by_their_hash():
    assert Counter(d.group for d in REAL_MESHES) == GROUPS
    checked = [d for d in REAL_MESHES if d.sha256]
    assert len(checked) == 201
    assert len({d.name for d in REAL_MESHES}) == len(REAL_MESHES)
    for d in REAL_MESHES:
        assert d.source_url.startswith("https://raw.githubusercontent.com/")
        assert " " not in d.source_url
        assert len(d.sha256) == 64 if d in checked else len(d.mesh_hash) == 64
        assert d.licence
    assert len({d.file for d in REAL_MESHES}) == len(REAL_MESHES), "two files of one name"


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("nefertiti", "nefertiti.obj"),
        ("cowboy-hat", "cowboy_hat.obj"),
        ("david-head", "david_head.obj"),
        ("stanford-bunny", "stanford_bunny.obj"),
        ("human-brain", "human_brain.obj"),
        ("alex-3holes", "holes/alex_3holes.obj"),
        ("bff-maze", "stress/maze.obj"),
        ("ict-face-narrow", "holes/ict_face_narrow.obj"),
    ],
)
def test_a_mesh_of_the_catalogue_is_recognised_in_another_file(name, file):
    mesh = read_mesh(real_mesh(file), TriangleMesh)
    (dataset,) = [d for d in REAL_MESHES if d.name == name]
    assert (mesh.hash, mesh.m) == (dataset.mesh_hash, dataset.faces)


def content(k):
    """A file of its own for each: a triangle as OBJ."""
    return f"v 0 0 0\nv 1 0 0\nv 0 {k + 1} 0\nf 1 2 3\n".encode() * (1 + k % 3)


@pytest.fixture
def served(monkeypatch, tmp_path):
    """48 datasets on a server on this machine, whose answers a test may change."""
    files = {f"mesh{k:02d}.obj": content(k) for k in range(48)}
    answers, asked = dict(files), Counter()
    slow, lock = threading.Event(), threading.Lock()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            name = self.path.lstrip("/")
            with lock:
                asked[name] += 1
            body = answers.get(name)
            self.send_response(404 if body is None else 200)
            self.send_header("Content-Length", str(len(files.get(name, b""))))
            self.end_headers()
            if body is not None and name == "mesh07.obj":
                slow.wait(20)
            self.wfile.write(body or b"")

        def log_message(self, *_):
            pass

    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=http.serve_forever, daemon=True)
    thread.start()
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("CEMBENCH_DATA_URL", f"http://127.0.0.1:{http.server_port}")
    datasets = [
        Dataset(
            name.removesuffix(".obj"),
            name,
            f"https://example.org/{name}",
            hashlib.sha256(body).hexdigest(),
            "none stated" if k == 5 else "MIT",
            size=len(body),
            group="disks",
        )
        for k, (name, body) in enumerate(files.items())
    ]
    installed = replace(load_registry(), datasets={d.name: d for d in datasets}, parts={})
    monkeypatch.setattr(registry, "_installed", lambda: installed)
    yield datasets, answers, asked, slow
    slow.set()
    http.shutdown()
    http.server_close()
    thread.join()


def test_48_of_48_are_fetched_and_checked(cli, served):
    datasets, _, asked, slow = served
    slow.set()
    code, out, err = cli("fetch", "--group", "disks")
    assert code == 0
    assert len(out.splitlines()) == 48
    assert all(is_fetched(d) for d in datasets)
    assert "48 files, 0 already here; to fetch: 3 kB." in err
    assert "48 of 48 fetched." in err
    assert "mesh05: " in out
    assert out.count("no licence stated: do not redistribute") == 1
    cli("fetch", "--group", "disks")
    assert set(asked.values()) == {1}


def test_bad_files_are_told_the_rest_is_done_and_the_next_call_resumes(cli, served):
    datasets, answers, asked, slow = served
    good = dict(answers)
    answers["mesh01.obj"] = bytes(len(answers["mesh01.obj"]))  # two altered
    answers["mesh02.obj"] = answers["mesh02.obj"].replace(b"v 1", b"v 2")
    answers["mesh03.obj"] = answers["mesh03.obj"][:9]  # one cut short
    answers["mesh04.obj"] = None  # one gone
    threading.Timer(1.0, slow.set).start()  # and one that is slow to come
    code, out, err = cli("fetch", "--group", "disks", "--json")
    assert code == 1
    by_key = {about["name"]: about for about in json.loads(out)}
    assert [name for name in by_key if "error" in by_key[name]] == [
        f"mesh0{k}" for k in range(1, 5)
    ]
    for k in (1, 2):
        assert "SHA-256" in by_key[f"mesh0{k}"]["error"]
    assert "404" in by_key["mesh04"]["error"]
    for k in range(1, 5):
        assert f"mesh0{k}.obj from http://127.0.0.1" in " ".join(err.split())
    assert sum(is_fetched(d) for d in datasets) == 44
    assert by_key["mesh07"]["fetched"]
    left = {p.name for p in datasets[0].path.parent.iterdir()}
    assert left == {d.file for d in datasets} - {f"mesh0{k}.obj" for k in range(1, 5)}

    answers.update(good)
    asked.clear()
    code, _, err = cli("fetch", "--group", "disks")
    assert code == 0
    assert "48 files, 44 already here" in err
    assert set(asked) == {f"mesh0{k}.obj" for k in range(1, 5)}


def test_drafts_and_files_that_vanish_while_they_are_looked_at_are_no_obstacle(
    served, monkeypatch, tmp_path
):
    """Other downloads rename their drafts in the same folder at any moment."""
    datasets, _, asked, _ = served
    wanted = datasets[0]
    folder = tmp_path / "mine"
    gone = folder / "a.obj"
    draft = folder / f".draft-{'0' * 12}-1-{'0' * 32}.obj"
    folder.mkdir()
    gone.write_bytes(content(0))
    draft.write_bytes(content(0))
    read = wholeness.sha256_of

    def vanishing(path):
        assert path != draft
        if path == gone:
            gone.unlink()
        return read(path)

    monkeypatch.setattr(wholeness, "sha256_of", vanishing)
    assert fetch(wanted, have=[folder]).read_bytes() == content(0)
    assert not gone.exists()
    assert asked[wanted.file] == 1


def test_a_slow_file_does_not_hold_up_the_others(served):
    datasets, _, _, slow = served
    order = []
    for one in fetch_all(datasets[:16], jobs=4):
        order.append(one.dataset.name)
        if len(order) == 15:
            assert "mesh07" not in order
            slow.set()
    assert order[-1] == "mesh07"


def test_a_server_that_says_nothing_is_given_up(served):
    datasets, _, _, _ = served
    (one,) = fetch_all([datasets[7]], timeout=0.3)
    assert one.path is None
    assert "mesh07.obj" in str(one.error)


def test_files_that_are_there_are_known_by_content_under_any_name(cli, served, tmp_path):
    datasets, answers, asked, _ = served
    mine = tmp_path / "mine"
    (mine / "deeper").mkdir(parents=True)
    (mine / "deeper" / "renamed.txt").write_bytes(answers["mesh10.obj"])
    assert cli("fetch", "mesh10", "mesh11", "--have", mine)[0] == 0
    assert set(asked) == {"mesh11.obj"}
    moved = datasets[11].path.rename(datasets[11].path.parent / "other.bin")
    assert not is_fetched(datasets[11])
    fetch(datasets[11])
    assert asked["mesh11.obj"] == 1
    assert moved.read_bytes() == datasets[11].path.read_bytes()


def test_an_altered_file_is_fetched_again(served):
    datasets, answers, asked, _ = served
    path = fetch(datasets[0])
    path.write_bytes(answers["mesh00.obj"].replace(b"v 1", b"v 3"))
    assert not is_fetched(datasets[0])
    assert fetch(datasets[0]).read_bytes() == answers["mesh00.obj"]
    assert asked["mesh00.obj"] == 2


def test_an_unknown_group_lists_the_known_ones(cli, served):
    code, _, err = cli("fetch", "--group", "heads")
    assert code == 2
    assert "unknown group of datasets 'heads'; known: disks." in err


def test_without_a_checksum_the_mesh_must_be_the_known_one(served):
    datasets, answers, _, _ = served
    whole = datasets[0]
    mesh = read_mesh(fetch(whole), TriangleMesh)
    other = replace(whole, name="mesh03", sha256="", size=None)
    known = replace(other, mesh_hash=mesh.hash)
    (one,) = fetch_all([known])
    assert "mesh is not the known one" in str(one.error)
    answers["mesh03.obj"] = answers["mesh00.obj"].ljust(len(answers["mesh03.obj"]), b"\n")
    (one,) = fetch_all([known])
    assert one.error is None
    assert is_fetched(known)


def test_a_part_of_a_file_is_read_alone(served, tmp_path):
    datasets, answers, _, slow = served
    slow.set()
    both = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 1 2 3\nf 4 5 6\n"
    answers["mesh47.obj"] = both.ljust(len(answers["mesh47.obj"]), b"\n")
    sha = hashlib.sha256(answers["mesh47.obj"]).hexdigest()
    part = replace(datasets[47], sha256=sha, polygons=(1, 1))
    fetch(part)
    mesh = read_mesh(surface_file(part), TriangleMesh)
    assert (mesh.name, mesh.n, mesh.m) == ("mesh47", 3, 1)
    assert mesh.V.min() == 5
    assert surface_file(datasets[0]) == datasets[0].path


def test_files_of_the_face_model_are_kept_as_small_arrays(monkeypatch, tmp_path):
    published = real_mesh("ict/identity001.obj")
    (dataset,) = [d for d in ICT_FACE if d.title == "identity001"]
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    monkeypatch.delenv("CEMBENCH_ICT_FACE", raising=False)
    from cembench.mesh import datasets

    monkeypatch.setattr(
        datasets, "_download", lambda d, file, *_: file.write(published.read_bytes())
    )
    path = fetch(dataset)
    assert path == tmp_path / "ict-face" / "identity001.npz"
    assert path.stat().st_size < 500_000
    assert read_small(path) is not None
    assert is_fetched(dataset)
    path.write_bytes(path.read_bytes()[:-50])
    assert not is_fetched(dataset)
    assert len(ICT_FACE) == 154


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [("sha256", "sha", "KeyError: 'sha256'"), ("19974", "many", "invalid literal for int")],
)
def test_a_table_of_meshes_with_a_fault_is_named(tmp_path, old, new, told):
    file = tmp_path / "models.tsv"
    file.write_text(OWN.read_text().replace(old, new))
    with pytest.raises(
        RegistryError, match=rf"models.tsv is no table of meshes: .*{told}.*Give it"
    ):
        read_datasets(file)
