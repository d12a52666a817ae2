"""A dataset of our own, offered as a user's package would, and a slow server on this machine."""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

NAME = "fuzz-tiny"
FILE = "fuzz-tiny.obj"
#: Pieces in which the file arrives, and the seconds between two of them.
PIECES, PAUSE = 20, 0.03

_MODULE = '''"""A dataset."""

from cembench.mesh.datasets import Dataset

tiny = Dataset("{name}", "Tiny", "https://example.org/{file}", "{sha256}", "MIT")
'''


def install(site: Path, content: bytes) -> None:
    """Write a package that offers the dataset into a folder for PYTHONPATH."""
    about = site / "fuzz_dataset-1.0.dist-info"
    about.mkdir(parents=True)
    checksum = hashlib.sha256(content).hexdigest()
    (site / "fuzz_dataset.py").write_text(_MODULE.format(name=NAME, file=FILE, sha256=checksum))
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: fuzz-dataset\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[cembench.datasets]\n{NAME} = fuzz_dataset:tiny\n")


@contextmanager
def server(content: bytes) -> Iterator[str]:
    """Serve the file slowly, so that a kill can meet it half-way; gives the URL."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            """Send the file in pieces."""
            self.send_response(200 if self.path == f"/{FILE}" else 404)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            size = -(-len(content) // PIECES)
            with suppress(OSError):  # who asked may have been killed
                for start in range(0, len(content), size):
                    self.wfile.write(content[start : start + size])
                    self.wfile.flush()
                    time.sleep(PAUSE)

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02})
    thread.daemon = True
    thread.start()
    try:
        yield f"http://127.0.0.1:{http.server_port}"
    finally:
        http.shutdown()
        http.server_close()
        thread.join()
