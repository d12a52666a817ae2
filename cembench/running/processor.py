"""CPU seconds of this process and of everything it has started, also of what outlived its parent.

What has ended and was waited for is in the system's sum for children; the rest is looked up in the
tree of processes. On Linux this process becomes the parent of descendants whose own parent is gone
(:func:`keep_orphans`), so they stay in the tree, and those that have ended too.
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

#: The option of ``prctl`` that makes a process the parent of orphans below it.
_SET_CHILD_SUBREAPER = 36
#: The state in /proc of a thread that runs, or waits for a processor.
_RUNS = "R"


@dataclass(frozen=True)
class Processor:
    """CPU seconds at one moment: differences of two of them mean something."""

    #: Of the thread that asks.
    thread: float
    #: Of this process, all threads together.
    process: float
    #: Of the processes it has started, directly or not.
    others: float
    #: How many other threads, of this process and of those, run or wait for a processor.
    running: int = 0

    @property
    def total(self) -> float:
        """Of the process and all it has started."""
        return self.process + self.others

    @property
    def beside(self) -> float:
        """The same, without the thread that asks."""
        return self.total - self.thread


def before_call() -> Processor:
    """How many CPU seconds were used until now? The look at other processes comes first."""
    others, running = _of_children(), others_running()
    return Processor(thread_time(), process_time(), others, running)


def after_call() -> Processor:
    """The same, and the look at other processes comes last."""
    process, thread = process_time(), thread_time()
    return Processor(thread, process, _of_children(), others_running())


def keep_orphans() -> None:
    """Become the parent of descendants whose parent ends (Linux; elsewhere nothing)."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def others_running() -> int:
    """How many threads run, or would, but the one that asks? Those of descendants are counted."""
    count = running_threads(os.getpid(), get_native_id())
    if _has_children():
        with suppress(psutil.Error):
            tree = psutil.Process().children(recursive=True)
            count += sum(running_threads(one.pid) for one in tree)
    return count


def running_threads(pid: int, but: int = 0) -> int:
    """How many of a process's threads run or wait for a processor? 0 where nobody tells (Linux)."""
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
    """CPU seconds of all descendants, ended ones included."""
    total = 0.0
    with suppress(ImportError):  # Windows
        import resource

        waited = resource.getrusage(resource.RUSAGE_CHILDREN)
        total = waited.ru_utime + waited.ru_stime
    if _has_children():
        with suppress(psutil.Error):
            total += sum(map(_seconds_of, psutil.Process().children(recursive=True)))
    return total


def _has_children() -> bool:
    """Whether there may be any: a look at two files, where the system has them."""
    tasks = Path("/proc/self/task")
    try:
        return any((task / "children").read_text() for task in tasks.iterdir())
    except OSError:
        return True


def _seconds_of(process: psutil.Process) -> float:
    """Those of a process and of its children that it has waited for; of one that ended as well."""
    with suppress(psutil.Error):
        times = process.cpu_times()
        return float(
            times.user
            + times.system
            + getattr(times, "children_user", 0.0)
            + getattr(times, "children_system", 0.0)
        )
    return 0.0
