"""Call a built-in algorithm once in this process, which spares a user the start of two others.

What is measured is the same: one call with one thread, judged by the same code. Processes of their
own are for what is compared, for plug-ins and programs, and where a limit has to be kept.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import numpy as np
import psutil
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from cembench.results.records import Record
from cembench.running.environment import describe_environment
from cembench.running.estimate import LARGE, ROUGH_BYTES_A_FACE
from cembench.running.measure import check_cell
from cembench.running.plan import Task
from cembench.running.recorder import now, record_of
from cembench.running.worker import load_libraries

#: Package of the algorithms that are called here.
BUILT_IN = "cembench.algorithms."
#: Share of the free memory that a call may need by a rough estimate.
_SHARE = 0.5


def may_run_here(task: Task) -> bool:
    """Whether a cell can do without a process of its own: built in, one thread, and not large."""
    algorithm, mesh = task.algorithm, task.mesh
    if not algorithm.module.startswith(BUILT_IN) or algorithm.program or algorithm.library:
        return False
    free = psutil.virtual_memory().available
    small = mesh.m < LARGE and ROUGH_BYTES_A_FACE * mesh.m < _SHARE * free
    return small and task.cell.threads == 1


def map_here(task: Task) -> tuple[Record, NDArray[np.complex128] | None]:
    """Call once in this process, and keep nothing on disk; see :func:`local.map_once`.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.

    """
    started = now()
    load_libraries()
    with threadpool_limits(limits=1), _interruptible() as stopped:
        outcome, uv = check_cell(task.algorithm, task.mesh, task.cell)
    if stopped:
        raise KeyboardInterrupt
    return record_of(task, outcome, describe_environment()["id"], started), uv


@contextmanager
def _interruptible() -> Iterator[list[int]]:
    """Yield a list that Ctrl-C adds to; the call takes the exception for an error of its own."""
    stopped: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield stopped  # where signals do not arrive
        return

    def stop(number: int, frame: FrameType | None) -> None:
        stopped.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield stopped
    finally:
        signal.signal(signal.SIGINT, before)
