"""Measure one algorithm on one surface in this process, and check what it returns.

Timed is the call alone, from the arrays V and F in memory to uv: the boundary loops, the Laplacian,
ordering, factorisation and iterations, and nothing else. An algorithm's word is not trusted:
:func:`faults` looks at the result, and the metrics are computed here.
"""

from __future__ import annotations

import gc
import math
import traceback
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.clock import Timing, measure
from cembench.errors import AlgorithmFailed
from cembench.geometry.cholesky import linear_algebra
from cembench.geometry.mesh import TriangleMesh
from cembench.metrics import all_metrics, flipped_triangles, image_area
from cembench.parameterization import Parameterization
from cembench.records import Outcome
from cembench.registry import Algorithm

#: How far from the unit circle a boundary vertex of a disk may lie.
CIRCLE_TOLERANCE = 1e-9


def measure_cell(
    algorithm: Algorithm,
    arguments: dict[str, Any],
    mesh: TriangleMesh,
    *,
    solves: str = "reuse",
    backend: str = "cvxopt",
    repeats: int = 1,
    warm_up: bool = False,
) -> tuple[Outcome, NDArray[np.complex128] | None]:
    """How long does it take, what comes out, and is that a valid map?

    Never raises for what the algorithm does: :class:`~cembench.errors.AlgorithmFailed` or any other
    exception is a status with its cause. The second value is the map, also that of an invalid one
    if it has the right shape and is finite.
    """
    before = mesh.hash

    def call() -> Any:
        fresh = mesh.fresh()
        return measure(lambda: algorithm.function(fresh, **arguments))

    results: list[tuple[Any, Timing]] = []
    try:
        with linear_algebra(solves, backend):
            if warm_up:
                call()
            for _ in range(repeats):
                gc.collect()
                gc.disable()
                try:
                    results.append(call())
                finally:
                    gc.enable()
    except AlgorithmFailed as error:
        cause = "; ".join([str(error), *_broken_premises(mesh)])
        return Outcome(status="failed", cause=cause), None
    except MemoryError as error:
        return Outcome(status="out_of_memory", cause=str(error) or "MemoryError"), None
    except Exception as error:
        cause = f"{type(error).__name__}: {error}"
        return Outcome(status="failed", cause=cause, traceback=traceback.format_exc()), None

    found = results[-1][0]
    timings = sorted((timing for _, timing in results), key=lambda timing: timing.total)
    outcome = Outcome(
        status="invalid",
        seconds=tuple(timing.total for _, timing in results),
        phases=timings[(len(timings) - 1) // 2].phases,
    )
    unusable = _unusable(found, mesh)
    if unusable:
        return outcome.model_copy(update={"cause": unusable}), None
    problems = faults(algorithm, mesh, found.uv)
    if TriangleMesh(mesh.V, mesh.F).hash != before:
        problems.append("the algorithm changed the mesh it was given")
    metrics = all_metrics(mesh, found.uv)
    described = {
        "status": "invalid" if problems else "ok",
        "cause": "; ".join(problems) or None,
        "metrics": {name: v if math.isfinite(v) else None for name, v in metrics.items()},
        "iterations": found.iterations,
        "energy_history": tuple(found.energy_history),
        "extras": found.extras,
    }
    return outcome.model_copy(update=described), found.uv


def _unusable(found: Any, mesh: TriangleMesh) -> str | None:
    """Why can no figure be computed from this result? None where it can."""
    if not isinstance(found, Parameterization):
        return f"it returned a {type(found).__name__}, not a Parameterization"
    uv = found.uv
    if not isinstance(uv, np.ndarray) or uv.shape != (mesh.n,) or uv.dtype != np.complex128:
        got = f"{uv.dtype} {uv.shape}" if isinstance(uv, np.ndarray) else type(uv).__name__
        return f"uv is {got}; required is complex128 ({mesh.n},)"
    bad = np.flatnonzero(~np.isfinite(uv))
    if len(bad):
        return f"uv is NaN or infinite at {len(bad)} vertices, the first being {bad[0]}"
    return None


def _broken_premises(mesh: TriangleMesh) -> list[str]:
    broken = [notice for notice in mesh.notices if notice.startswith("Definition 1")]
    return [f"the mesh breaks a premise of the paper: {'; '.join(broken)}"] if broken else []


def faults(algorithm: Algorithm, mesh: TriangleMesh, uv: NDArray[np.complex128]) -> list[str]:
    """Which promises does this map break? Empty for a valid one."""
    problems = []
    if algorithm.target == "disk":
        off = np.abs(np.abs(uv[mesh.loops[0]]) - 1).max()
        if off > CIRCLE_TOLERANCE:
            problems.append(f"the boundary lies off the unit circle by up to {off:.2g}")
    flipped = flipped_triangles(mesh, uv)
    if image_area(mesh, uv) <= 0 or flipped == mesh.m:
        problems.append("the map reverses the surface's orientation")
    elif flipped:
        problems.append(f"{flipped} of {mesh.m} triangles are folded ({flipped / mesh.m:.2%})")
        problems += _broken_premises(mesh)
    return problems
