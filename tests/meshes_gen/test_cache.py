"""The cache of surfaces: one key, whole files only, two processes at once."""

from __future__ import annotations

import multiprocessing
import time
from pathlib import Path

import pytest
from cembench.surfaces import cache
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.mesh.triangle_mesh import DiskMesh


@pytest.fixture(autouse=True)
def directory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    return tmp_path


def _make(size: int = 600) -> DiskMesh:
    return spherical_cap(size)


def _never() -> DiskMesh:
    raise AssertionError("made anew")


def test_made_once() -> None:
    first = cache.cached(DiskMesh, "cap", {"faces": 600}, _make)
    again = cache.cached(DiskMesh, "cap", {"faces": 600}, _never)
    assert again.hash == first.hash
    assert (again.name, again.notices) == (first.name, first.notices)
    assert not again.V.flags.writeable


def test_key_depends_on_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = {
        cache.content_key("a", {"faces": 1}),
        cache.content_key("b", {"faces": 1}),
        cache.content_key("a", {"faces": 2}),
    }
    monkeypatch.setattr(cache, "GENERATOR_VERSION", cache.GENERATOR_VERSION + 1)
    keys.add(cache.content_key("a", {"faces": 1}))
    monkeypatch.setattr(cache, "version_of", lambda package: "0")
    keys.add(cache.content_key("a", {"faces": 1}))
    assert len(keys) == 5


@pytest.mark.parametrize("damage", ["half", "empty", "one byte"])
def test_half_written_file_is_never_read(directory: Path, damage: str) -> None:
    mesh = cache.cached(DiskMesh, "cap", {}, _make)
    (path,) = (directory / "surfaces").iterdir()
    content = bytearray(path.read_bytes())
    if damage == "half":
        content = content[: len(content) // 2]
    elif damage == "empty":
        content = bytearray()
    else:
        content[1000] ^= 1
    path.write_bytes(content)
    assert cache.read(DiskMesh, path) is None
    assert cache.cached(DiskMesh, "cap", {}, _make).hash == mesh.hash
    assert cache.read(DiskMesh, path) is not None


def test_nothing_is_left_of_a_write_that_fails(
    directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(cache.np, "savez", fails)
    assert cache.cached(DiskMesh, "cap", {}, _make).m == 600
    assert list((directory / "surfaces").iterdir()) == []


def _worker(start: float, hashes: multiprocessing.Queue[str]) -> None:
    time.sleep(max(0.0, start - time.time()))
    for k in range(10):
        mesh = cache.cached(DiskMesh, "cap", {"k": k}, lambda: _make(20_000))
        hashes.put(mesh.hash)


def test_two_processes_at_once(directory: Path) -> None:
    context = multiprocessing.get_context("spawn")
    hashes = context.Queue()
    start = time.time() + 4
    workers = [context.Process(target=_worker, args=(start, hashes)) for _ in range(2)]
    for worker in workers:
        worker.start()
    seen = {hashes.get(timeout=600) for _ in range(20)}
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0, 0]
    assert seen == {_make(20_000).hash}
    assert len(list((directory / "surfaces").iterdir())) == 10
