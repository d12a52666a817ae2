"""Fetching, against a server on this machine."""

from __future__ import annotations

import hashlib
import io
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from cembench.errors import DatasetError, MeshError
from meshes_gen import datasets
from meshes_gen.disk_grid import disk_grid


def _mat() -> bytes:
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
def server(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Server]:
    server = Server()
    thread = threading.Thread(target=server.http.serve_forever, daemon=True)
    thread.start()
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    monkeypatch.setenv("CEMBENCH_DATA_URL", server.url)
    tiny = datasets.Dataset(
        "tiny", "Tiny", "tiny.mat", hashlib.sha256(server.content).hexdigest(), None
    )
    monkeypatch.setattr(datasets, "DATASETS", {"tiny": tiny})
    yield server
    server.http.shutdown()
    server.http.server_close()
    thread.join()


def test_good_file(server: Server) -> None:
    assert not datasets.is_fetched("tiny")
    mesh = datasets.load("tiny")
    assert (mesh.m, mesh.name) == (96, "tiny")
    assert datasets.is_fetched("tiny")


def test_cache_hit_asks_no_server(server: Server) -> None:
    first = datasets.fetch("tiny")
    assert datasets.fetch("tiny") == first
    assert server.requests == 1


def test_damaged_file_in_the_cache_is_fetched_anew(server: Server) -> None:
    path = datasets.fetch("tiny")
    path.write_bytes(server.content[:100])
    assert datasets.fetch("tiny").read_bytes() == server.content
    assert server.requests == 2


def test_wrong_checksum(server: Server) -> None:
    server.content = bytes(len(server.content))
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127.*SHA-256"):
        datasets.fetch("tiny")
    assert not datasets.dataset("tiny").path.exists()


def test_truncated_download(server: Server) -> None:
    server.content = server.content[:200]
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127"):
        datasets.fetch("tiny")
    assert not datasets.dataset("tiny").path.exists()


def test_server_down(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CEMBENCH_DATA_URL", "http://127.0.0.1:9/")
    with pytest.raises(DatasetError, match=r"tiny\.mat from http://127.0.0.1:9/tiny\.mat.*mirror"):
        datasets.fetch("tiny", timeout=2)


def test_missing_on_the_mirror(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CEMBENCH_DATA_URL", server.url + "/elsewhere")
    with pytest.raises(DatasetError, match="404"):
        datasets.fetch("tiny")


def test_unknown_name_lists_the_known() -> None:
    with pytest.raises(DatasetError, match="chinese-lion, human-brain, left-hand, human-face"):
        datasets.fetch("teapot")


def test_mat_without_the_variables(tmp_path: Path) -> None:
    path = tmp_path / "other.mat"
    savemat(path, {"v": np.zeros((3, 3)), "x": 1})
    with pytest.raises(MeshError, match="no variable 'f'; it has: v, x"):
        datasets.read_mat(path)


def test_file_that_is_no_mat(tmp_path: Path) -> None:
    path = tmp_path / "text.mat"
    path.write_text("hello")
    with pytest.raises(MeshError, match="cannot be read"):
        datasets.read_mat(path)
