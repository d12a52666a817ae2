"""CPU seconds of this process and all its descendants, including orphans.

Children that have ended and were waited for are in the system's sum for children; the others are
looked up in the process tree. On Linux this process adopts descendants whose own parent is gone
(:func:`keep_orphans`), so they stay in the tree, even after they have ended.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import get_native_id
from time import process_time, thread_time

import psutil

#: The option of ``prctl`` that makes a process adopt its orphaned descendants.
_SET_CHILD_SUBREAPER = 36
#: The state in /proc of a running or runnable thread.
_RUNS = "R"


@dataclass(frozen=True)
class Processor:
    """CPU seconds at one moment; only differences are meaningful."""

    #: CPU seconds of the calling thread.
    thread: float
    #: CPU seconds of all threads of this process.
    process: float
    #: CPU seconds of its descendants.
    others: float
    #: Number of other threads, of this process and its descendants, that run or wait to run.
    running: int = 0

    @property
    def total(self) -> float:
        """CPU seconds of the process and its descendants."""
        return self.process + self.others

    @property
    def beside(self) -> float:
        """CPU seconds of everything except the calling thread."""
        return self.total - self.thread


def before_call() -> Processor:
    """Return the CPU seconds so far; other processes are read first, before this thread."""
    others, running = _of_children(), others_running()
    return Processor(thread_time(), process_time(), others, running)


def after_call() -> Processor:
    """Return the CPU seconds so far; other processes are read last, after this thread."""
    thread_time()  # under a limit of CPU time (`ulimit -t`) Linux updates the process's clock by it
    process, thread = process_time(), thread_time()
    return Processor(thread, process, _of_children(), others_running())


def keep_orphans() -> None:
    """Adopt descendants whose parent ends (Linux only)."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def others_running() -> int:
    """Return the number of other running or runnable threads, including those of descendants."""
    count = running_threads(os.getpid(), get_native_id())
    if _has_children():
        with suppress(psutil.Error):
            tree = psutil.Process().children(recursive=True)
            count += sum(running_threads(one.pid) for one in tree)
    return count


def running_threads(pid: int, but: int = 0) -> int:
    """Return the number of running or runnable threads of a process; 0 if unknown (not Linux)."""
    count = 0
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            if int(task.name) == but:
                continue
            with suppress(OSError):
                state = (task / "stat").read_text().rpartition(")")[2].split()[0]
                count += state == _RUNS
    return count


def _of_children() -> float:
    """Return the CPU seconds of all descendants, including ended ones."""
    total = 0.0
    with suppress(ImportError):  # Windows
        import resource

        waited = resource.getrusage(resource.RUSAGE_CHILDREN)
        total = waited.ru_utime + waited.ru_stime
    if _has_children():
        with suppress(psutil.Error):
            total += sum(map(_seconds_of, psutil.Process().children(recursive=True)))
    return total


def children() -> list[int]:
    """Return the ids of the children of this process, which has one thread; quickly if possible."""
    with suppress(OSError):
        return [*map(int, Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())]
    return [child.pid for child in psutil.Process().children()]


def _has_children() -> bool:
    """Whether there may be children, read from two files if the system has them."""
    tasks = Path("/proc/self/task")
    try:
        return any((task / "children").read_text() for task in tasks.iterdir())
    except OSError:
        return True


def _seconds_of(process: psutil.Process) -> float:
    """Return the CPU seconds of a process, running or ended, and of children it waited for."""
    with suppress(psutil.Error):
        times = process.cpu_times()
        return float(
            times.user
            + times.system
            + getattr(times, "children_user", 0.0)
            + getattr(times, "children_system", 0.0)
        )
    return 0.0
