"""Call a built-in algorithm once in this process, which spares a user the start of two others.

What is measured is the same: one call with one thread, judged by the same code. Processes of their
own are for what is compared, for plug-ins and programs, and where a limit has to be kept.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import psutil
from threadpoolctl import ThreadpoolController

from cembench.core.arrays import Complex
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import Record
from cembench.running.environment import describe_environment
from cembench.running.measure import check_cell, check_overlay
from cembench.running.plan import Task
from cembench.running.recorder import now, record_of
from cembench.running.usual_costs import ROUGH_BYTES_A_FACE

#: Package of the algorithms that are called here.
BUILT_IN = "cembench.algorithms."
#: Modules that are loaded on demand elsewhere, and that most calls need.
_CALLED = ("scipy.linalg", "scipy.sparse.linalg")
#: Share of the free memory that a call may need by a rough estimate.
_SHARE = 0.5


def may_run_here(task: Task) -> bool:
    """Whether a cell can do without a process of its own: built in, one thread, enough memory."""
    algorithm, mesh = task.algorithm, task.mesh
    if not algorithm.module.startswith(BUILT_IN) or algorithm.program or algorithm.library:
        return False
    free = psutil.virtual_memory().available
    return ROUGH_BYTES_A_FACE * mesh.m < _SHARE * free and task.cell.threads == 1


@contextmanager
def numerical_threads(count: int) -> Iterator[None]:
    """Let the numerical libraries use so many threads, and OpenBLAS one, as where calls are timed.

    Its sums, and so maps, would depend on the number.
    """
    for name in _CALLED:  # one that is loaded later has its own number
        importlib.import_module(name)
    found = ThreadpoolController()
    with found.limit(limits=count), found.select(internal_api="openblas").limit(limits=1):
        yield


def map_here(task: Task) -> tuple[Record, Complex | None]:
    """Call once in this process, and keep nothing on disk; see :func:`local.map_once`."""
    return _recorded(task, check_cell)


def overlay_here(task: Task) -> tuple[Record, TriangleMesh, Complex | None]:
    """Map a surface on the algorithm's refinement of it, in this process; also return that."""
    return _recorded(task, check_overlay)


def _recorded(task: Task, check: Callable[..., tuple[Any, ...]]) -> tuple[Any, ...]:
    """Return the record of a checked call, with what else the check returns."""
    started = now()
    with numerical_threads(1):
        outcome, *returned = check(task.algorithm, task.mesh, task.cell)
    return record_of(task, outcome, describe_environment()["id"], started), *returned
