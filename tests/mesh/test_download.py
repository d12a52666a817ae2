"""Servers that are slow, silent, endless or lie: a download is bounded, and can be stopped."""

import hashlib
import io
import os
import signal
import subprocess
import sys
import threading
from contextlib import closing
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event

import pytest

from cembench.core.errors import DatasetError
from cembench.mesh import datasets, download
from cembench.mesh.datasets import Dataset, fetch, fetch_all
from cembench.mesh.download import Bounds, DownloadError
from cembench.registry import load_registry

SIZE = 1000
TINY = Dataset("tiny", "Tiny", "https://example.org/tiny.mat", "0" * 64, "MIT", size=SIZE)


class Handler(BaseHTTPRequestHandler):
    """Answers as the first part of the path says, until the other side hangs up."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        way = self.path.split("/")[1]
        if way == "silent":
            self.server.over.wait()
            return
        if way == "elsewhere":  # an endless answer that names another address
            self.send_response(302)
            self.send_header("Location", "/elsewhere/tiny.mat")
        else:
            self.send_response(200)
        if way == "announcing":
            self.send_header("Content-Length", str(10**12))
        if way == "packed":
            self.send_header("Content-Encoding", "gzip")
        self.send_header("Connection", "close")
        self.end_headers()
        piece, pause = (b"x", 0.05) if way == "trickling" else (b"x" * 2**16, 0)
        try:
            while not self.server.over.wait(pause):
                self.wfile.write(piece)
                self.server.sent += len(piece)
        except OSError:
            self.server.hung_up.set()

    def log_message(self, *_):
        pass


@pytest.fixture
def server(monkeypatch, tmp_path):
    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    http.over, http.hung_up, http.sent = Event(), Event(), 0
    thread = threading.Thread(target=http.serve_forever, daemon=True)
    thread.start()
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))

    def answers(way):
        monkeypatch.setenv("CEMBENCH_DATA_URL", f"http://127.0.0.1:{http.server_port}/{way}")
        return http

    yield answers
    http.over.set()
    http.shutdown()
    http.server_close()
    thread.join()


def nothing_left(tmp_path):
    """Whether the cache holds neither a file nor a part of one."""
    return [path for path in (tmp_path / "cache").rglob("*") if not path.is_dir()] == []


@pytest.mark.parametrize("way", ["endless", "packed"])
@pytest.mark.parametrize("size", [SIZE, None])
def test_no_more_is_read_than_was_published(server, tmp_path, monkeypatch, way, size):
    http = server(way)
    monkeypatch.setattr(datasets, "LARGEST", 10 * SIZE)
    most = size or 10 * SIZE
    with pytest.raises(DatasetError, match=rf"sends [\d,]+ bytes or more; .* at most {most:,}"):
        fetch(replace(TINY, size=size))
    assert http.hung_up.wait(30), "the server still sends"
    assert nothing_left(tmp_path)


def test_an_answer_that_announces_too_much_is_not_read(server, tmp_path):
    server("announcing")
    with pytest.raises(DatasetError, match=r"sends 1,000,000,000,000 bytes or more"):
        fetch(TINY)
    assert nothing_left(tmp_path)


@pytest.mark.parametrize(
    ("way", "why"),
    [
        ("silent", r"did not answer within 0\.5 s|Read timed out"),
        ("trickling", r"sent [\d,]+ bytes in 0\.5 s; needed are 4,096 a second"),
    ],
)
def test_a_server_that_hardly_sends_is_given_up(server, tmp_path, way, why):
    server(way)
    with pytest.raises(DatasetError, match=why):
        fetch(replace(TINY, size=None), timeout=0.5)
    assert nothing_left(tmp_path)


@pytest.mark.parametrize("way", ["silent", "trickling", "endless"])
def test_a_deadline_ends_a_download_whatever_the_server_does(server, tmp_path, way):
    server(way)
    with pytest.raises(DatasetError, match="its time is over"):
        fetch(replace(TINY, size=10**12), seconds=0.3)
    assert nothing_left(tmp_path)


def test_the_content_of_a_redirection_is_not_read_and_their_number_is_bounded(server):
    http = server("elsewhere")
    with pytest.raises(DatasetError, match="names another address 10 times"):
        fetch(TINY)
    assert http.sent < 100 * 2**20


def test_a_stop_ends_a_download_at_once(server):
    http, stop = server("trickling"), Event()
    threading.Timer(0.2, stop.set).start()
    with pytest.raises(DownloadError, match="it was stopped"):
        download.download(
            f"http://127.0.0.1:{http.server_port}/trickling", io.BytesIO(), Bounds(stop=stop)
        )


def test_all_downloads_end_when_nobody_asks_for_more(server, tmp_path):
    server("trickling")
    several = [replace(TINY, name=f"d{k}", source_url=f"http://x/{k}.mat") for k in range(3)]
    here = replace(TINY, sha256=hashlib.sha256(b"here").hexdigest())
    here.path.parent.mkdir(parents=True)
    here.path.write_bytes(b"here")
    with closing(fetch_all([here, *several], timeout=3600)) as downloads:
        assert next(downloads).path == here.path
    assert sorted((tmp_path / "cache").rglob("*.mat")) == [here.path]


@pytest.mark.process
@pytest.mark.parametrize("way", ["silent", "trickling"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_fetch_while_a_server_sends(server, tmp_path, way, number, code):
    http = server(way)
    names = [d.name for d in load_registry().datasets.values() if d.sha256 and not d.part][:2]
    asked = Event()
    before = http.process_request

    def told(*given):
        asked.set()
        before(*given)

    http.process_request = told
    command = [sys.executable, "-m", "cembench", "fetch", *names]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, env=dict(os.environ))
    try:
        assert asked.wait(60)
        process.send_signal(number)
        assert process.wait(30) == code
    finally:
        process.kill()
        process.communicate()
    assert nothing_left(tmp_path)
