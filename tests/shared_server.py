"""Servers that outlive a run: what a run starts is forked from one that an earlier test left.

Starting an interpreter takes a second, and a run starts several. With :func:`kept_servers` a run
forks where it always does, from a server that is given back and not ended when the run is over.
With :func:`one_server` it forks also what it starts as an interpreter of its own: for tests that
are not about processes. A server has loaded only the libraries, whoever it has served.
"""

from pathlib import Path
from typing import ClassVar

import pytest

from cembench.linear_algebra.backends import default_backend
from cembench.running import launcher, plugins
from cembench.running.environment import for_measuring
from cembench.running.fork_server import ForkServer, can_fork
from cembench.running.launcher import Launcher

#: Of the environment, what changes from test to test and is of no use to a process that measures.
IRRELEVANT = ("PYTEST_CURRENT_TEST", "COLUMNS")
#: How many servers may wait for the next run.
MOST = 3


class _Kept(ForkServer):
    """A server which is idle when it is closed, and then serves the next one who needs its like."""

    key = None
    #: In the order in which they were given back.
    idle: ClassVar = []

    @classmethod
    def of(cls, environment, backend):
        """Return an idle server with this environment and back end, or a new one."""
        key = backend, {k: v for k, v in environment.items() if k not in IRRELEVANT}
        for server in cls.idle:
            if server.key == key and server._process.poll() is None:
                cls.idle.remove(server)
                return server
        server = cls(environment, backend)
        server.key = key
        return server

    def close(self):
        """Give it back; end the one that has waited longest where there are too many."""
        if self.key is None:  # it did not start
            self.end()
        elif self not in self.idle:
            self.idle.append(self)
        for surplus in self.idle[:-MOST]:
            self.idle.remove(surplus)
            surplus.end()

    def end(self):
        super().close()


@pytest.fixture(scope="session")
def _servers():
    yield
    while _Kept.idle:
        _Kept.idle.pop().end()


@pytest.fixture
def kept_servers(_servers, monkeypatch):
    """Fork from servers of earlier tests, one started before a test limits its process."""
    write = Launcher._write

    def write_absolute(self, job):
        """The server is not in the test's folder."""
        absolute = tuple(
            str(Path(plugin).absolute()) if plugin.endswith(".py") else plugin
            for plugin in job.plugins
        )
        return write(self, job.model_copy(update={"plugins": absolute}))

    monkeypatch.setattr(launcher, "ForkServer", _Kept.of)
    monkeypatch.setattr(Launcher, "_write", write_absolute)
    if can_fork(1):
        _Kept.of(for_measuring(1), default_backend()).close()


#: What plug-ins that could be imported hold.
_TRIED = set()


@pytest.fixture
def one_server(kept_servers, monkeypatch):
    """Fork also what is started as an interpreter of its own; try each plug-in once."""
    started, tried = Launcher._started, plugins._try

    def try_once(plugin, seconds):
        content = Path(plugin).read_bytes() if Path(plugin).is_file() else None
        if content is None or content not in _TRIED:
            tried(plugin, seconds)
            _TRIED.add(content)

    def fork(self, job, limits, log):
        if not can_fork(job.cell.threads):
            return started(self, job, limits, log)
        server = _Kept.of(for_measuring(job.cell.threads), job.cell.backend)
        try:
            ending = self._forked(server, job, limits, log, alone=False)
            return ending or started(self, job, limits, log)
        finally:
            server.close()

    monkeypatch.setattr(Launcher, "_started", fork)
    monkeypatch.setattr(plugins, "_try", try_once)
