"""Measure one algorithm on one surface in this process, and check what it returns.

Timed is the call alone, from the arrays V and F in memory to uv: the boundary loops, the Laplacian,
ordering, factorisation and iterations, and nothing else. An algorithm's word is not trusted:
:func:`faults` looks at the result, and the metrics are computed here.
"""

from __future__ import annotations

import gc
import hashlib
import math
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import all_metrics, boundary_circles, flipped_triangles, image_area
from cembench.conformal.planar import crossing_segments, polygon_area
from cembench.core.clock import Timing, measure
from cembench.core.errors import AlgorithmFailed, CembenchError
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import Boundary, Cell, Outcome, Round
from cembench.running.memory import Memory, memory_of_call

#: How far from the unit circle a boundary vertex of a disk may lie.
CIRCLE_TOLERANCE = 1e-9
#: How far from a circle, relative to its radius, a hole's image may be and still be called one.
CIRCULAR = 1e-3
#: A process times further calls until they have taken so many seconds together, or are so many.
ENOUGH_SECONDS = 0.1
ENOUGH_CALLS = 5
#: A first call that takes so many seconds is not repeated: a warm-up saves tenths of one.
LONG_CALL = 5.0

#: The cause where the arrays V and F are not as they were before the call.
MESH_CHANGED = "the algorithm changed the mesh it was given"

Call = Callable[[], tuple[Any, Timing]]


def check_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell
) -> tuple[Outcome, NDArray[np.complex128] | None]:
    """What comes out of one call, is that a valid map, and how much memory does it take?

    Never raises for what the algorithm does: :class:`~cembench.core.errors.AlgorithmFailed` or any
    other exception is a status with its cause. The one round of the outcome is this call, without
    warm-up. The second value is the map, also that of an invalid one if it has the right shape and
    is finite.
    """
    before = mesh.hash
    call = _call(algorithm, mesh, cell)
    try:
        with linear_algebra(cell.solves, cell.backend):
            (found, timing), memory = memory_of_call(lambda: _without_collector(call))
    except Exception as error:
        return outcome_of_error(error, mesh), None
    outcome = _with_memory(Outcome(status="invalid", rounds=(_round([timing]),)), memory)
    unusable = _unusable(found, mesh)
    if unusable:
        return outcome.model_copy(update={"cause": unusable}), None
    problems = faults(algorithm, mesh, found.uv)
    if TriangleMesh(mesh.V, mesh.F).hash != before:
        problems.append(MESH_CHANGED)
    metrics = all_metrics(mesh, found.uv)
    described = {
        "status": "invalid" if problems else "ok",
        "cause": "; ".join(problems) or None,
        "metrics": {name: _finite(v) for name, v in metrics.items()},
        "boundaries": _boundaries(mesh, found.uv),
        "notes": tuple(remarks(algorithm, mesh, found.uv)),
        "iterations": found.iterations,
        "energy_history": tuple(found.energy_history),
        "extras": found.extras,
        "uv_hash": _hash(found.uv),
    }
    return outcome.model_copy(update=described), found.uv


def time_cell(algorithm: Algorithm, mesh: TriangleMesh, cell: Cell) -> Round:
    """How long does a call take, after one to warm up? Several calls where they are short.

    A call of more than :data:`LONG_CALL` seconds is timed without a warm-up.

    Raises whatever the algorithm raises.
    """
    call = _call(algorithm, mesh, cell)
    timings: list[Timing] = []
    with linear_algebra(cell.solves, cell.backend):
        found, timing = _without_collector(call)
        if timing.total > LONG_CALL:
            return _round([timing], _hash(getattr(found, "uv", None)))
        gc.collect()
        gc.freeze()  # collecting again looks at what is new, and leaves the rest out of the caches
        while len(timings) < ENOUGH_CALLS and sum(t.total for t in timings) < ENOUGH_SECONDS:
            found, timing = _without_collector(call)
            timings.append(timing)
        gc.unfreeze()
    return _round(timings, _hash(getattr(found, "uv", None)))


def outcome_of_error(error: Exception, mesh: TriangleMesh) -> Outcome:
    """As what is a call on this mesh recorded that raised this?"""
    if isinstance(error, AlgorithmFailed):
        cause = "; ".join([str(error), *_broken_premises(mesh)])
        return Outcome(status="failed", cause=cause, gave_up=True)
    if isinstance(error, CembenchError):
        return Outcome(status="failed", cause=str(error))
    told = "".join(traceback.format_exception(error))
    if isinstance(error, MemoryError):
        return Outcome(
            status="out_of_memory", cause=str(error) or "memory was refused", traceback=told
        )
    return Outcome(status="failed", cause=f"{type(error).__name__}: {error}", traceback=told)


def _call(algorithm: Algorithm, mesh: TriangleMesh, cell: Cell) -> Call:
    arguments = algorithm.arguments(cell.parameters)

    def call() -> tuple[Any, Timing]:
        fresh = mesh.fresh()
        return measure(lambda: algorithm.function(fresh, **arguments))

    return call


def _without_collector(call: Call) -> tuple[Any, Timing]:
    gc.collect()
    gc.disable()
    try:
        return call()
    finally:
        gc.enable()


def _round(timings: list[Timing], uv_hash: str | None = None) -> Round:
    middle = sorted(timings, key=lambda timing: timing.total)[(len(timings) - 1) // 2]
    calls = tuple(timing.total for timing in timings)
    return Round(calls=calls, phases=middle.phases, uv_hash=uv_hash)


def _with_memory(outcome: Outcome, memory: Memory) -> Outcome:
    found = {"peak_memory_bytes": memory.peak, "memory_increase_bytes": memory.increase}
    return outcome.model_copy(update=found)


def _hash(uv: Any) -> str | None:
    return hashlib.sha256(uv.tobytes()).hexdigest() if isinstance(uv, np.ndarray) else None


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
    if algorithm.target in ("disk", "circular holes"):
        outer = max(mesh.loops, key=lambda loop: polygon_area(uv[loop]))
        name = "boundary" if len(mesh.loops) == 1 else "outer boundary"
        off = np.abs(np.abs(uv[outer]) - 1).max()
        if off > CIRCLE_TOLERANCE:
            problems.append(f"the {name} lies off the unit circle by up to {off:.2g}")
    if algorithm.target == "circular holes":
        problems += _crossings(mesh, uv)
    flipped = flipped_triangles(mesh, uv)
    if image_area(mesh, uv) <= 0 or flipped == mesh.m:
        problems.append("the map reverses the surface's orientation")
    elif flipped:
        problems.append(f"{flipped} of {mesh.m} triangles are folded ({flipped / mesh.m:.2%})")
        problems += _broken_premises(mesh)
    return problems


def _crossings(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> list[str]:
    """Do the boundaries' images cross?

    Where no triangle is folded and none do, the map is injective: a point has as many preimages as
    the outer polygon winds round it, less the holes'.
    """
    crossing = crossing_segments([uv[loop] for loop in mesh.loops])
    if crossing is None:
        return []
    one, other = (f"boundary {int(mesh.loops[k].min())}" for k in crossing)
    whom = "itself" if one == other else other
    return [f"{one} crosses {whom} (boundaries are called by their smallest vertex)"]


def remarks(algorithm: Algorithm, mesh: TriangleMesh, uv: NDArray[np.complex128]) -> list[str]:
    """What should a reader know of a valid map? That its holes are no circles, where they are none.

    How circular the holes are is a figure like the energy, not a promise: `boundaries` has it.
    """
    if algorithm.target != "circular holes":
        return []
    circles = boundary_circles(mesh, uv)[1:]
    off = [circle for circle in circles if not circle.circularity <= CIRCULAR]
    if not off:
        return []
    worst = max(circle.circularity for circle in off)
    return [
        f"{len(off)} of {len(circles)} holes are no circles: off by up to {worst:.2g} of the radius"
    ]


def _boundaries(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> tuple[Boundary, ...]:
    if len(mesh.loops) == 1:
        return ()
    return tuple(
        Boundary(
            vertex=circle.vertex,
            vertices=circle.vertices,
            centre=(circle.centre.real, circle.centre.imag),
            radius=_finite(circle.radius),
            circularity=_finite(circle.circularity),
        )
        for circle in boundary_circles(mesh, uv)
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
