"""Judge the maps that calls returned, in a process that never imports the algorithm.

The map of the first call, on the original surface, is the recorded one: its promises are judged and
its metrics computed. Each timed call gets the surface in a different motion
(:mod:`cembench.running.rigid_motion`); its map must keep the promises too, and must be the map of
that moved surface.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from statistics import median_low
from typing import Any

import numpy as np
from pydantic import BaseModel

from cembench.conformal.atlas import atlas_metrics
from cembench.conformal.metrics import (
    METRICS,
    MapFigures,
    all_metrics,
    boundary_circles,
    computed,
    dirichlet_energy,
    image_area,
    lost_in_rounding,
)
from cembench.core.arrays import Complex
from cembench.core.errors import describe_error
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import SAME_ENERGY, Boundary, Fault, FaultKind, Outcome, not_ok
from cembench.running.map_promises import Promise, faults, remarks
from cembench.running.quality import quality_notes
from cembench.running.rigid_motion import UNMOVED, in_first_order, moved
from cembench.running.sanitized_result import hash_of, outcome_of_error

#: Largest distance of a vertex, relative to the image's size, between maps that are equal to
#: rounding, and between maps of two motions.
SAME_MAP, NEARLY_THE_SAME = 1e-8, 1e-4
#: Largest distance of a vertex, relative to the image's size, between maps that differ by a
#: rotation, a scale and a shift: a stretch of the surface changes maps by 1e-9 at least.
SAME_SHAPE = 1e-12
#: Largest difference between a map of a process with earlier calls and one of a fresh process, as
#: a multiple of that between fresh ones, for which a randomised solver is believed to keep nothing.
SCATTER = 10.0
#: How many times that of the check the E_C of the timed maps may be; the check's counts as this
#: share of the area at least. Where symmetry or the numbering decides, as for LDM, it is up to five
#: times that in a call.
FAR_WORSE, MIN_ENERGY = 10.0, 1e-4
#: Names of first calls that are not timed: the first warms up, a second is for comparison only.
WARM_UP, SECOND_CALL = "the warm-up", "the second call"
#: Maximum number of entries of a map that are kept for comparisons.
SAMPLED = 4096


class Checked(BaseModel):
    """Hash and relative energy of the checked map, for comparison with timed calls."""

    uv_hash: str | None = None
    #: E_C over area; None: only the promises of the target are judged.
    relative_energy: float | None = None

    @classmethod
    def of(cls, outcome: Outcome) -> Checked:
        """Return the comparison data of a checked call."""
        return cls(uv_hash=outcome.uv_hash, relative_energy=outcome.relative_energy)


class JudgedCalls(BaseModel):
    """The result of judging a process's maps."""

    #: Faults of the first invalid map.
    faults: tuple[Fault, ...] = ()
    #: Faults of valid maps that are not maps of the given surface.
    kept: tuple[Fault, ...] = ()
    #: The motion of a map far from the checked one; a call in a fresh process must show whether it
    #: is right.
    doubtful: str | None = None
    #: Whether all compared maps agree to rounding; None if none could be compared.
    repeated: bool | None = None
    #: The largest difference from a known map of the same motion, relative to its size.
    difference: float | None = None
    #: Whether a turn, a scale and a shift do not explain that difference.
    differs: bool = False
    #: The median E_C over area of the timed maps; None where it is not compared.
    energy: float | None = None


def sample(uv: Complex) -> Complex:
    """Return at most :data:`SAMPLED` entries of a map, evenly spaced."""
    return np.array(uv[:: max(1, -(-len(uv) // SAMPLED))])


def kept_from_call_to_call(difference: float, scatter: float) -> Fault | None:
    """Return the fault that a process with earlier calls maps in another way than fresh ones.

    `difference` is that between their maps of one surface, `scatter` the largest one seen between
    fresh processes: 0 for a deterministic solver.
    """
    if difference <= max(SAME_MAP, SCATTER * scatter):
        return None
    message = (
        f"maps of the same surface differ by {difference:.2g} between a fresh process and one with "
        f"earlier calls, but by {scatter:.2g} at most between fresh ones: results are kept from "
        "call to call"
    )
    return Fault(kind=FaultKind.KEPT_RESULT, detail=message)


def judged_check(
    promise: Promise, mesh: TriangleMesh, called: Outcome, uv: Complex, *, figures: bool = True
) -> Outcome:
    """Return the outcome of the checked call, with the judgement of its map.

    Without `figures`, it has faults, but no metrics and no remarks.
    """
    try:
        if figures:
            about, more = _judged(promise, mesh, uv, called.extras)
        else:
            with _warnings_ignored():
                about, more = {}, faults(promise, mesh, uv)
    except MemoryError as error:
        return outcome_of_error(error, mesh)
    except Exception as error:
        message = f"its metrics cannot be computed: {describe_error(error)}"
        about, more = {}, [Fault(kind=FaultKind.NO_METRICS, detail=message)]
    problems = [*more, *called.faults]
    outcome = not_ok("invalid", *problems) if problems else Outcome(status="ok")
    about["notes"] = (*about.get("notes", ()), *called.notes)
    verdict = {"status": outcome.status, "cause": outcome.cause, "faults": outcome.faults}
    return called.model_copy(update=about | verdict | {"uv_hash": hash_of(uv)})


def judged_calls(
    promise: Promise,
    mesh: TriangleMesh,
    checked: Checked,
    maps: Sequence[tuple[str, str, Complex]],
    known: Mapping[str, Complex],
) -> JudgedCalls:
    """Judge the maps of a process, each given with its name, motion and values.

    `known` holds samples of maps from other processes by motion, in the surface's own order; that
    of :data:`UNMOVED` is the checked one.
    """
    seen, shapes = {checked.uv_hash: UNMOVED}, dict(known)
    repeated, far, doubtful, differs = None, None, None, False
    energies: list[float] = []
    for name, motion, uv in maps:
        bits, mine = hash_of(uv), sample(in_first_order(uv, mesh, motion))
        others = [one for other, one in shapes.items() if other != motion]
        kept = seen.setdefault(bits, motion) != motion or _is_among(others, mine)
        shapes.setdefault(motion, mine)
        if kept and not promise.combinatorial:
            message = (
                f"{name} returned the same map for a surface of another shape: the map was "
                "kept from another call, or does not depend on the coordinates (then declare "
                "combinatorial=True)"
            )
            return JudgedCalls(kept=(Fault(kind=FaultKind.KEPT_RESULT, detail=message),))
        if motion == UNMOVED and bits == checked.uv_hash:
            repeated = repeated is not False
            far = far or 0.0
            continue
        surface = moved(mesh, motion)
        with _warnings_ignored():
            wrong = faults(promise, surface, uv)
            if not wrong and checked.relative_energy is not None:
                energy = _relative_energy(promise, surface, uv)
                energies += [energy] if name not in (WARM_UP, SECOND_CALL) else []
                wrong = _other_energy(energy, checked.relative_energy)
        only_energy = wrong and wrong[0].kind is FaultKind.OTHER_ENERGY
        other = known.get(motion)
        if other is not None:
            away = difference(mine, other)
            repeated = repeated is not False and away <= SAME_MAP
            far = max(far or 0.0, away)
            differs |= difference(*_aligned(mine, other)) > SAME_MAP
            if away <= SAME_MAP and only_energy:
                wrong = []
        elif only_energy:
            near = any(difference(mine, one) <= NEARLY_THE_SAME for one in known.values())
            doubtful = doubtful or (None if near and motion != UNMOVED else motion)
            wrong = [] if motion != UNMOVED else wrong
        if wrong:
            message = f"{name} returned a different map from the check"
            return JudgedCalls(faults=(Fault(kind=FaultKind.OTHER_MAP, detail=message), *wrong))
    typical = median_low(energies) if energies else None
    worse = _far_worse(typical, checked.relative_energy)
    return JudgedCalls(
        kept=worse,
        doubtful=doubtful,
        repeated=repeated,
        difference=far,
        differs=differs,
        energy=typical,
    )


def difference(mine: Complex, other: Complex) -> float:
    """Return the distance between the samples of two maps, relative to the second one's size."""
    if mine.shape != other.shape:
        return math.inf
    return float(np.abs(mine - other).max() / max(np.abs(other).max(), 1e-300))


def _is_among(others: Sequence[Complex], mine: Complex) -> bool:
    """Whether a map has the shape of two others, or of the only other one.

    Two of many may agree by chance, where a map depends on one length of the surface alone.
    """
    return sum(_same_shape(mine, one) for one in others) >= min(2, len(others)) > 0


def _same_shape(mine: Complex, other: Complex) -> bool:
    """Whether the sample of a map is another one's, turned, scaled and shifted."""
    if mine.shape != other.shape:
        return False
    a, b = _aligned(mine, other)
    return bool(a.any()) and difference(a, b) <= SAME_SHAPE


def _aligned(mine: Complex, other: Complex) -> tuple[Complex, Complex]:
    """Return the other map turned, scaled and shifted onto mine, and mine, both about 0."""
    if mine.shape != other.shape:
        return mine, other
    a, b = other - other.mean(), mine - mine.mean()
    return np.vdot(a, b) / max(np.vdot(a, a).real, 1e-300) * a, b


def _relative_energy(promise: Promise, mesh: TriangleMesh, uv: Complex) -> float:
    """Return E_C over the image's area."""
    if promise.target == "atlas":
        figures = atlas_metrics(mesh, uv.reshape(-1, 3))
        return figures["conformal_energy"] / figures["image_area"]
    area = image_area(mesh, uv)
    return (dirichlet_energy(mesh, uv) - area) / area


def _other_energy(energy: float, checked: float) -> list[Fault]:
    if abs(energy - checked) <= SAME_ENERGY:
        return []
    message = f"E_C over the area is {energy:.9g}, not {checked:.9g}"
    return [Fault(kind=FaultKind.OTHER_ENERGY, detail=message)]


def _far_worse(energy: float | None, checked: float | None) -> tuple[Fault, ...]:
    """Return the fault that timed maps are far worse than the check's, if they are."""
    if energy is None or checked is None or energy <= FAR_WORSE * max(checked, MIN_ENERGY):
        return ()
    message = (
        f"E_C over the area of the timed maps is {energy:.3g}, of the checked one {checked:.3g}: "
        "the seconds do not belong to the map that is shown"
    )
    return (Fault(kind=FaultKind.OTHER_ENERGY, detail=message),)


def _judged(
    promise: Promise, mesh: TriangleMesh, uv: Complex, extras: Mapping[str, Any]
) -> tuple[dict[str, Any], list[Fault]]:
    """Return the fields of an outcome for a map, and the faults."""
    with _warnings_ignored():
        problems = faults(promise, mesh, uv)
        if promise.target == "atlas":
            metrics = atlas_metrics(mesh, uv.reshape(-1, 3))
            notes = [] if problems else lost_in_rounding(metrics)
            return {"metrics": _all_finite(metrics), "notes": tuple(notes)}, problems
        of_map = MapFigures(mesh, uv)
        metrics = computed(METRICS, of_map)
        notes = [] if problems else [*remarks(promise, mesh, uv), *lost_in_rounding(metrics)]
        if not problems:
            notes += quality_notes(promise.target, of_map, extras)
        about = {
            "metrics": _all_finite(metrics),
            "boundaries": _boundaries(mesh, uv),
            "notes": tuple(notes),
        }
    return about, problems


def figures(target: str, mesh: TriangleMesh, uv: Complex) -> dict[str, float | None]:
    """Return the metrics of a map to a target, by name; None for one that is not finite."""
    with _warnings_ignored():
        atlas = target == "atlas"
        return _all_finite(
            atlas_metrics(mesh, uv.reshape(-1, 3)) if atlas else all_metrics(mesh, uv)
        )


def _all_finite(metrics: Mapping[str, float]) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in metrics.items()}


@contextmanager
def _warnings_ignored() -> Iterator[None]:
    """Ignore warnings, which the algorithm may have turned into errors in NumPy or Python."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _boundaries(mesh: TriangleMesh, uv: Complex) -> tuple[Boundary, ...]:
    circles = boundary_circles(mesh, uv) if len(mesh.loops) > 1 else ()
    if not all(np.isfinite(circle.centre) for circle in circles):
        return ()
    return tuple(
        Boundary(
            vertex=circle.vertex,
            vertices=circle.vertices,
            centre=(circle.centre.real, circle.centre.imag),
            radius=_finite(circle.radius),
            circularity=_finite(circle.circularity),
        )
        for circle in circles
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
