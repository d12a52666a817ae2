"""A server of small models on this machine; some of its names misbehave."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from cembench.surfaces.flat_disk import flat_disk

from tests import gallery

_FLAT = flat_disk(200)
_DISK = gallery.obj_text(_FLAT.V, _FLAT.F).encode()


def content_of(name):
    """The file of a model: the same disk, so that all have as many bytes, under its name."""
    return _DISK + f"# {name:<20}\n".encode()


class ModelsServer:
    """Sends the model of any name but those that begin with how they misbehave."""

    def __init__(self):
        self.asked, self.released = 0, threading.Event()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                outer.asked += 1
                way = self.path.strip("/")
                if way.startswith("hangs"):
                    outer.released.wait()
                self.send_response(404 if way.startswith("missing") else 200)
                self.end_headers()
                if way.startswith("trickles"):
                    while not outer.released.wait(0.05):
                        self.wfile.write(b"v")
                content = content_of("another" if way.startswith("lies") else way[:-4])
                self.wfile.write(content * (1 + way.startswith("sends-more")))

            def log_message(self, *_):
                pass

            def handle(self):
                try:
                    super().handle()
                except ConnectionError:
                    """The client had enough."""

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._http.server_port}"

    def __enter__(self):
        self._thread = threading.Thread(target=self._http.serve_forever, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.released.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()
