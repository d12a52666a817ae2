"""One server from which a test process forks all that a run starts, instead of an interpreter each.

Starting an interpreter takes a second, and a run starts several. Where a test is not about
processes, it may use the fixture :func:`one_server`: what is measured still runs in a process of
its own, which is forked from a server that has loaded only the libraries.
"""

from pathlib import Path

import pytest

from cembench.linear_algebra.backends import default_backend
from cembench.running.environment import for_measuring
from cembench.running.fork_server import ForkServer, ServerGoneError, can_fork
from cembench.running.launcher import Launcher
from cembench.running.process import run_limited


class _Servers:
    """The last server, with the environment and the back end that it was started with."""

    def __init__(self):
        self.key, self.server = None, None

    def of(self, environment, backend):
        key = backend, {k: v for k, v in environment.items() if k != "PYTEST_CURRENT_TEST"}
        if self.key != key:
            self.end()
            self.server, self.key = ForkServer(environment, backend), key
        return self.server

    def end(self):
        if self.server is not None:
            self.server.close()
        self.key, self.server = None, None


@pytest.fixture(scope="session")
def _servers():
    servers = _Servers()
    yield servers
    servers.end()


@pytest.fixture
def one_server(_servers, monkeypatch):
    """Fork checks, too, and all from one server, started before a test limits its process."""
    if can_fork(1):
        _servers.of(for_measuring(1), default_backend())
    write, started = Launcher._write, Launcher._started

    def fork(self, job, limits, log):
        if self.number or not can_fork(job.cell.threads):  # several at a time need several servers
            return started(self, job, limits, log)
        try:
            server = _servers.of(for_measuring(job.cell.threads), job.cell.backend)
            path = self._write(job.model_copy(update={"parent": server.pid}))
            return run_limited(server.forking(path), limits, log, stopped=self.stopped.is_set)
        except ServerGoneError:
            _servers.end()
            return started(self, job, limits, log)

    def write_absolute(self, job):
        """The server is not in the test's folder."""
        plugins = tuple(
            str(Path(plugin).absolute()) if plugin.endswith(".py") else plugin
            for plugin in job.plugins
        )
        return write(self, job.model_copy(update={"plugins": plugins}))

    monkeypatch.setattr(Launcher, "_started", fork)
    monkeypatch.setattr(Launcher, "_forked", fork)
    monkeypatch.setattr(Launcher, "_write", write_absolute)
