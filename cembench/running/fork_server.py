"""Start processes quickly by forking a server that has only loaded the libraries.

Loading the libraries takes longer than most calls. A server loads them with a fixed number of
threads and waits; the processes of a round are forked from it, one after the other. It never sees a
mesh, an algorithm or a plug-in, so a forked process has the state of a fresh interpreter before its
first job. Used on Linux with one thread only, because thread pools do not survive a fork.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np

from cembench.linear_algebra.cholesky import linear_algebra
from cembench.running import worker
from cembench.running.process import MARK, Start, die_with_parent
from cembench.running.processor import children, keep_orphans

#: Placeholder in the server's environment, as long as the mark that a forked process writes there.
_NO_MARK = "0" * 32
#: Seconds within which what a process left is ended; what starts processes faster stays.
_MAX_SECONDS = 5.0


class ServerGoneError(Exception):
    """The server has ended or was killed."""


def can_fork(threads: int) -> bool:
    """Whether processes with this many threads can be forked on this system."""
    return threads == 1 and sys.platform == "linux" and hasattr(os, "pidfd_open")


class ForkServer:
    """Client of the server in the process that starts it; the server ends with it or on close.

    Raises
    ------
    ServerGoneError
        The server could not load the libraries, or one of them starts threads.
    """

    def __init__(self, environment: Mapping[str, str], backend: str) -> None:
        self.backend = backend
        self._asked = 0
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "cembench.running.fork_server", str(os.getpid()), backend],
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**environment, MARK: _NO_MARK},
            start_new_session=True,
        )
        self.pid = self._process.pid
        try:
            self._answer()
        except ServerGoneError:
            self.close()
            raise

    def forking(self, job_file: Path) -> Start:
        """Return a function for `run_limited` that forks a process for the job in this file."""

        def start(mark: str, log: Path) -> _Forked:
            pid = self.ask({"job": str(job_file), "log": str(log), "mark": mark})
            assert pid is not None
            return _Forked(self, pid)

        return start

    def ask(self, request: object) -> int | None:
        """Return the server's answer; raise :class:`ServerGoneError` if it is gone.

        A signal may end a request before its answer is read; the next one passes that over.
        """
        assert self._process.stdin is not None
        self._asked += 1
        try:
            self._process.stdin.write(json.dumps([self._asked, request]).encode() + b"\n")
        except BrokenPipeError:
            raise ServerGoneError from None
        return self._answer()

    def _answer(self) -> int | None:
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            with suppress(ValueError):  # the rest of a line whose beginning was read
                answer: list[int | None] = json.loads(line)
                if answer[0] == self._asked:
                    return answer[1]
        raise ServerGoneError

    def cpu_seconds(self) -> float:
        """Return the CPU seconds of the last process as the system has them; 0: unknown."""
        with suppress(ServerGoneError):
            return (self.ask("cpu") or 0) / 1e6
        return 0.0

    def close(self) -> None:
        """End the server."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()


@dataclass
class _Forked:
    """A child of the server, with the interface of `subprocess.Popen`."""

    server: ForkServer
    pid: int
    code: int | None = None

    def poll(self) -> int | None:
        return self._ask("poll")

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end, after which the server ends what the process left."""
        code = self._ask("wait")
        assert code is not None
        return code

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)

    def _ask(self, what: str) -> int | None:
        if self.code is None or what == "wait":
            try:
                self.code = self.server.ask(what)
            except ServerGoneError:
                self.code = -signal.SIGKILL  # its children are killed with it
        return self.code


def _serve() -> dict[str, str]:
    """Answer requests on standard input, one per line; return that of each forked process in it.

    Such a request has the job's file, the log and the mark.
    """
    requests = os.fdopen(0, "rb", buffering=0, closefd=False)
    child, code, cpu = 0, None, 0
    _say(0, None)
    while line := requests.readline():
        number, request = json.loads(line)
        if request in ("poll", "wait", "cpu"):
            if code is None:
                pid, status, used = os.wait4(child, os.WNOHANG if request == "poll" else 0)
                code = os.waitstatus_to_exitcode(status) if pid else None
                cpu = round(1e6 * (used.ru_utime + used.ru_stime))
            if request == "wait":
                _end_children()
            _say(number, cpu if request == "cpu" else code)
            continue
        child, code = os.fork(), None
        if not child:
            return request
        with suppress(OSError):  # already done by the child, or the child has ended
            os.setpgid(child, child)
        _say(number, child)
    os._exit(0)


def _end_children() -> None:
    """End what a process left, its orphans: this server has adopted them.

    One may have left its group, its environment and its limits, and be a new process every moment.
    """
    until = monotonic() + _MAX_SECONDS
    with suppress(ChildProcessError):  # none is left
        while monotonic() < until:
            while os.waitpid(-1, os.WNOHANG)[0]:
                """It has ended."""
            for child in children():
                with suppress(PermissionError):
                    os.kill(child, signal.SIGKILL)


def _say(number: int, answer: int | None) -> None:
    os.write(1, json.dumps([number, answer]).encode() + b"\n")


def _set_up_process(order: dict[str, str]) -> None:
    """Join a new process group, set the mark, close the input, and write to the log."""
    os.setpgid(0, 0)
    for file, way, targets in (
        (os.devnull, os.O_RDONLY, (0,)),
        (order["log"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, (1, 2)),
    ):
        opened = os.open(file, way)
        for target in targets:
            os.dup2(opened, target)
        os.close(opened)
    # Overwrites the placeholder where the system reads the environment of a process.
    getenv = ctypes.CDLL(None).getenv
    getenv.restype = ctypes.c_void_p
    ctypes.memmove(getenv(MARK.encode()), order["mark"].encode(), len(_NO_MARK))
    os.environ[MARK] = order["mark"]
    np.random.seed()  # noqa: NPY002 - of the global generator; Python's own is seeded by the fork


def _load(backend: str) -> None:
    """Load what every process needs, and check that no library has started threads."""
    worker.load_libraries()
    with linear_algebra(backend=backend):
        """Entering it loads the library."""
    if len(list(Path("/proc/self/task").iterdir())) > 1:
        sys.exit("a library has started a thread")
    gc.collect()
    gc.freeze()  # loaded objects are permanent: processes need not scan them for garbage


def _main(parent: int, backend: str) -> None:
    """Load the libraries, serve requests, and run the job in each forked process."""
    die_with_parent(parent)
    keep_orphans()
    _load(backend)
    order = _serve()
    _set_up_process(order)
    worker.main(Path(order["job"]))
    worker.end()


if __name__ == "__main__":
    _main(int(sys.argv[1]), sys.argv[2])
