"""CPU seconds of this process and all its descendants, including orphans.

Children that have ended and were waited for are in the system's sum for children; the others are
looked up in the process tree. On Linux this process adopts descendants whose own parent is gone
(:func:`keep_orphans`), so they stay in the tree, even after they have ended.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import get_native_id
from time import monotonic, process_time, sleep, thread_time

import psutil

#: The option of ``prctl`` that makes a process adopt its orphaned descendants.
_SET_CHILD_SUBREAPER = 36
#: The state in /proc of a running or runnable thread.
_RUNS = b"R"
#: CPU seconds that a process may use to start: an interpreter with its libraries.
STARTING = 1.0
#: A process has started when so many looks, so many seconds apart, find it asleep; for so long a
#: call's new processes are waited for at most.
_ASLEEP, _POLL_SECONDS, _MAX_SECONDS = 3, 0.005, 5.0


@dataclass(frozen=True)
class Processor:
    """CPU seconds at one moment; only differences are meaningful."""

    #: CPU seconds of the calling thread.
    thread: float
    #: CPU seconds of all threads of this process.
    process: float
    #: CPU seconds of descendants that have ended, and of the others by their ids.
    ended: float = 0.0
    children: Mapping[int, float] = field(default_factory=dict)
    #: Number of other threads, of this process and its descendants, that run or wait to run.
    running: int = 0
    #: CPU seconds that this look itself took of the calling thread.
    looking: float = 0.0

    @property
    def others(self) -> float:
        """CPU seconds of all descendants."""
        return self.ended + sum(self.children.values())

    @property
    def total(self) -> float:
        """CPU seconds of the process and its descendants."""
        return self.process + self.others

    @property
    def beside(self) -> float:
        """CPU seconds of everything except the calling thread."""
        return self.total - self.thread

    def starts_since(self, earlier: Processor) -> float:
        """Return the CPU seconds since then with which processes have started."""
        return sum(
            min(seconds, STARTING) - min(earlier.children.get(pid, 0.0), STARTING)
            for pid, seconds in self.children.items()
        )


def before_call() -> Processor:
    """Return the CPU seconds so far; other processes are read first, before this thread."""
    began = thread_time()
    ended, below, running = _ended_children(), _by_descendant(), others_running()
    thread = thread_time()
    return Processor(thread, process_time(), ended, below, running, thread - began)


def after_call(before: Processor | None = None) -> Processor:
    """Return the CPU seconds so far; other processes are read last, after this thread.

    With the look `before` the call, this waits until processes that it has started are up: their
    start is no part of the next call.
    """
    thread_time()  # under a limit of CPU time (`ulimit -t`) Linux updates the process's clock by it
    process, thread = process_time(), thread_time()
    ended, below, running = _ended_children(), _by_descendant(), others_running()
    if before is not None:
        _wait_for(below.keys() - before.children.keys())
    return Processor(thread, process, ended, below, running, thread_time() - thread)


def _wait_for(started: Collection[int]) -> None:
    """Wait until these processes sleep, or have ended."""
    until, asleep = monotonic() + _MAX_SECONDS, 0
    while started and asleep < _ASLEEP and monotonic() < until:
        sleep(_POLL_SECONDS)
        asleep = 0 if any(map(running_threads, started)) else asleep + 1


def keep_orphans() -> None:
    """Adopt descendants whose parent ends (Linux only)."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def others_running() -> int:
    """Return the number of other running or runnable threads, including those of descendants."""
    own = running_threads(os.getpid(), get_native_id())
    return own + sum(map(running_threads, descendants()))


def running_threads(pid: int, but: int = 0) -> int:
    """Return the number of running or runnable threads of a process; 0 if unknown (not Linux)."""
    count = 0
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            if int(task.name) == but:
                continue
            with suppress(OSError):
                count += (task / "stat").read_bytes().rpartition(b")")[2].split()[0] == _RUNS
    return count


def _ended_children() -> float:
    """Return the CPU seconds of descendants that have ended and were waited for."""
    with suppress(ImportError):  # Windows
        import resource

        waited = resource.getrusage(resource.RUSAGE_CHILDREN)
        return waited.ru_utime + waited.ru_stime
    return 0.0


def _by_descendant() -> dict[int, float]:
    """Return the CPU seconds of the descendants that were not waited for, by their ids."""
    return {pid: _seconds_of(pid) for pid in descendants()}


def descendants() -> list[int]:
    """Return the ids of all descendants of this process, from a few files where possible."""
    try:
        below = _children_of(os.getpid())
    except OSError:
        with suppress(psutil.Error):
            return [process.pid for process in psutil.Process().children(recursive=True)]
        return []
    for pid in below:  # which grows
        with suppress(OSError):
            below += _children_of(pid)
    return below


def children() -> list[int]:
    """Return the ids of the children of this process, from a few files where possible."""
    with suppress(OSError):
        return _children_of(os.getpid())
    return [child.pid for child in psutil.Process().children()]


def _children_of(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return [int(child) for task in tasks for child in (task / "children").read_bytes().split()]


def _seconds_of(pid: int) -> float:
    """Return the CPU seconds of a process, running or ended, and of children it waited for."""
    with suppress(psutil.Error):
        times = psutil.Process(pid).cpu_times()
        return float(
            times.user
            + times.system
            + getattr(times, "children_user", 0.0)
            + getattr(times, "children_system", 0.0)
        )
    return 0.0
