"""A plug-in of algorithms that are never called: what starts processes answers at once instead.

Only for :mod:`benchmarks.cluster_cost`, whose workers import it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench import DiskMesh, Parameterization, algorithm
from cembench.results.records import Outcome, Round
from cembench.running.map_checks import Checked
from cembench.running.plan import Task
from cembench.running.timing import CellTimer

#: How many algorithms there are.
COUNT = 10


def _check(self: CellTimer, task: Task) -> tuple[Outcome, NDArray[np.complex128] | None]:
    return Outcome(status="ok", uv_hash="x"), np.ones(task.mesh.n, complex)


def _time(self: CellTimer, task: Task, checked: Checked) -> Round | Outcome:
    return Round(calls=(1e-3,) * 5)


def _declare(number: int) -> None:
    @algorithm(f"empty-{number}", title=f"Empty {number}", target="disk")
    def empty(mesh: DiskMesh) -> Parameterization:
        raise NotImplementedError

    globals()[f"empty_{number}"] = empty


for k in range(COUNT):
    _declare(k)
CellTimer.check, CellTimer.time = _check, _time  # type: ignore[method-assign]
