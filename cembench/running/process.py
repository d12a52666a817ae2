"""Run a command under limits, and end all processes that it started.

The limits apply to everything that the command starts. Its descendants are tracked while it runs,
and recognised afterwards by a mark in their environment, so that even one that left the process
group, or whose parent is gone, is ended. On Linux a limit of no other use is a second mark: it is
inherited by those, too, that take another environment, and cannot be raised again by a user.
"""

from __future__ import annotations

import ctypes
import os
import select
import signal
import subprocess
import sys
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import IO, Protocol, TypeAlias

import psutil

from cembench.running.processor import running_threads

#: Seconds between two looks at the memory. Each look uses milliseconds of another core.
POLL_SECONDS = 0.1
#: Number of bytes kept from the end of a process's output.
KEPT_OUTPUT_BYTES = 4000
#: An output file larger than this is emptied.
_LARGEST_LOG_BYTES = 2**20
#: Environment variable that marks all processes of a command.
MARK = "CEMBENCH_PROCESS"
#: The limit that is a mark, that of message queues in bytes (Linux), and its largest value as one.
_LIMIT, _LARGEST_MARK = getattr(psutil, "RLIMIT_MSGQUEUE", None), 800_000


@dataclass(frozen=True)
class Limits:
    """Limits of a process and its children."""

    #: Wall-clock seconds.
    seconds: float
    #: Resident bytes, summed over the process tree; None: no limit.
    memory_bytes: int | None = None


@dataclass(frozen=True)
class ProcessEnd:
    """The end of a process: its exit code (negative: a signal), or the limit it reached."""

    code: int
    #: "time" or "memory" if it was ended at that limit.
    limit: str | None
    #: Peak resident bytes of the tree seen by a look; 0 if it ended before the first look.
    seen_bytes: int
    #: The end of its standard output and error.
    said: str
    #: Number of processes that it left behind, which were ended.
    left: int = 0
    #: Number of running or runnable threads of the tree at each look.
    running: tuple[int, ...] = ()
    #: CPU seconds of the process and the children it waited for, from the system; 0: unknown.
    cpu_seconds: float = 0.0

    @property
    def how(self) -> str:
        """A description of the end: the signal, or the exit code with the last line of output."""
        if self.code < 0:
            return f"was ended by signal {signal_name(-self.code)}"
        last = f": {self.said.splitlines()[-1]}" if self.said else ""
        return f"ended with code {self.code}{last}"


def signal_name(number: int) -> str:
    """Return the name of a signal, or its number: most real-time signals have no name."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return str(number)


class StartedProcess(Protocol):
    """A process that leads its group; the part of `subprocess.Popen` that is used here."""

    @property
    def pid(self) -> int:
        """The id of the process and of its group."""

    def poll(self) -> int | None:
        """Return the exit code; None while the process runs."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the process to end, and return the exit code."""

    def kill(self) -> None:
        """Kill the process if it is running."""


#: Starts a process, given its mark (32 characters) and its output file.
Start: TypeAlias = Callable[[str, Path], StartedProcess]


def spawning(command: Sequence[str], environment: Mapping[str, str]) -> Start:
    """Return a function that starts a command in this environment."""

    def start(mark: str, log: Path) -> StartedProcess:
        with log.open("ab") as output:  # append mode, so that truncated output stays truncated
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**environment, MARK: mark},
                start_new_session=True,
            )

    return start


def run_limited(
    start: Start,
    limits: Limits,
    log: Path,
    *,
    alone: bool = False,
    stopped: Callable[[], bool] = lambda: False,
) -> ProcessEnd:
    """Run a process until it ends or reaches a limit; then end everything that it started.

    `log` is a file for its output, of which only the end is kept. With `alone`, the process is
    known to start no others, so leftovers are not searched for. The process is ended early if
    `stopped` returns True.
    """
    mark = uuid.uuid4().hex
    limit, seen, said = None, 0, b""
    running: list[int] = []
    log.touch()
    process = start(mark, log)
    tree: dict[int, psutil.Process] = {}
    inherited = 0
    with suppress(psutil.NoSuchProcess):
        tree[process.pid] = psutil.Process(process.pid)
        inherited = _mark_by_limit(tree[process.pid], mark)
    deadline = monotonic() + limits.seconds
    try:
        while not _ended_within(process, min(POLL_SECONDS, max(deadline - monotonic(), 0))):
            _follow(tree, process.pid)
            seen = max(seen, sum(map(_resident_bytes, tree.values())))
            running.append(sum(map(running_threads, tree)))
            said = _drain(log, said)
            if limits.memory_bytes is not None and seen > limits.memory_bytes:
                limit = "memory"
            elif monotonic() >= deadline:
                limit = "time"
            if limit or stopped():
                break
    finally:
        if not alone:
            _follow(tree, process.pid)
        code, left = _end_all(process, tree, *(("", 0) if alone else (mark, inherited)))
    with suppress(OSError), log.open("rb") as file:  # the process may have removed it
        said = (said + end_of(file))[-KEPT_OUTPUT_BYTES:]
    output = said.decode(errors="replace").strip()
    return ProcessEnd(code, limit, seen, output, left, tuple(running))


def _ended_within(process: StartedProcess, seconds: float) -> bool:
    """Wait at most `seconds` for the end; on Linux the wait ends as soon as the process does."""
    if process.poll() is not None:
        return True
    if hasattr(os, "pidfd_open"):
        with suppress(ProcessLookupError):  # the process has ended and its exit code was collected
            handle = os.pidfd_open(process.pid)
            try:
                select.select([handle], [], [], seconds)
            finally:
                os.close(handle)
        return process.poll() is not None
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    return process.poll() is not None


def _follow(tree: dict[int, psutil.Process], root: int) -> None:
    """Add the new children of the processes in the tree."""
    for known in list(tree.values()):
        with suppress(psutil.Error):
            for child in known.children(recursive=known.pid == root):
                tree.setdefault(child.pid, child)


def _resident_bytes(process: psutil.Process) -> int:
    try:
        resident: int = process.memory_info().rss
    except psutil.Error:
        return 0
    return resident


def _drain(log: Path, said: bytes) -> bytes:
    """Empty a log that grows too large; return the output kept, with its end.

    The process writes in append mode, so it continues at the new end.
    """
    with suppress(OSError):  # the process may have removed it
        if log.stat().st_size > _LARGEST_LOG_BYTES:
            with log.open("rb") as file:
                said = end_of(file)
            os.truncate(log, 0)
    return said


def end_of(file: IO[bytes], length: int = KEPT_OUTPUT_BYTES) -> bytes:
    """Return the last `length` bytes of a file, or all of a shorter one."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - length))
    return file.read()


def _end_all(
    process: StartedProcess, tree: dict[int, psutil.Process], mark: str, inherited: int
) -> tuple[int, int]:
    """End the process and every descendant, twice: one may have started another meanwhile.

    Returns the exit code of the process and the number of descendants.
    """
    code, left = process.poll(), set()
    for _ in range(2):
        marked = _marked(mark, inherited) if mark else []
        others = [one for one in {*tree.values(), *marked} if one.pid != process.pid]
        left |= {one.pid for one in others if _is_running(one)}
        if os.name == "posix":
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        elif code is None:
            process.kill()
        for one in others:
            with suppress(psutil.Error):
                one.kill()
        patience = monotonic() + 1
        while any(map(_is_running, others)) and monotonic() < patience:
            sleep(0.01)
    ended = process.wait()
    return (ended if code is None else code), len(left)


def _is_running(process: psutil.Process) -> bool:
    """Whether a process is still running; a zombie is not."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


def _marked(mark: str, inherited: int) -> list[psutil.Process]:
    """Return the processes with one of the marks, whatever their parent is now."""
    processes = []
    for one in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            if (inherited and one.rlimit(_LIMIT)[1] == inherited) or one.environ().get(
                MARK
            ) == mark:
                processes.append(one)
    return processes


def finds_all() -> bool:
    """Whether a descendant is found that has another environment, and whose parent is gone."""
    return _LIMIT is not None


def _mark_by_limit(process: psutil.Process, mark: str) -> int:
    """Mark a process by a limit that its descendants inherit; return it, 0 where there is none."""
    with suppress(psutil.Error, OSError):
        if _LIMIT is not None:
            _, hard = process.rlimit(_LIMIT)
            half = (_LARGEST_MARK if hard < 0 else min(hard, _LARGEST_MARK)) // 2
            if half > 0:
                value = half + int(mark[:12], 16) % half
                process.rlimit(_LIMIT, (value, value))
                return value
    return 0


def die_with_parent(parent: int) -> None:
    """Make the system end this process when its parent is killed (Linux only).

    `parent` is the parent's process id; the parent may have been killed already.
    """
    if sys.platform != "linux":
        return
    set_parent_death_signal = 1
    ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def limit_memory(memory_bytes: int) -> None:
    """Limit the memory that this process can reserve between two looks at it (not on Windows).

    The system counts reserved rather than resident memory, so the bound is half as much again.
    """
    try:
        import resource
    except ImportError:
        return
    reserve = 2**30
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    bound = memory_bytes + memory_bytes // 2 + reserve
    if hard != resource.RLIM_INFINITY:
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, hard))
