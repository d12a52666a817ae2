"""Stage 2: whether maps are valid, tend to conformal ones, and ignore numbering and pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from cembench.conformal.certificate import certify
from cembench.conformal.metrics import (
    CIRCULAR,
    all_metrics,
    angle_errors,
    boundary_circularity,
    flipped_triangles,
    image_area,
)
from cembench.core.arrays import Complex
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.records import relative_energy
from cembench.running.map_promises import CIRCLE_TOLERANCE
from cembench.validation import surfaces
from cembench.validation.alignment import distance
from cembench.validation.finding import ValidationFinding, finding
from cembench.validation.solver import CheckedMap, Solver

_finding = partial(finding, "correctness")

#: Allowed relative change of figures, and of maps, if the same surface is given differently.
SAME_FIGURES = 1e-6
#: Allowed change of a map between the two linear-algebra policies.
SAME_MAP = 1e-9
#: Least order of E_C and of the mean angle error in the triangle size h. Linear elements
#: promise 2 and 1.
ENERGY_ORDER, ANGLE_ORDER = 1.5, 0.75
#: Below this (relative to the area; in degrees), an error is rounding and has no order.
ENERGY_ROUNDING, ANGLE_ROUNDING = 1e-12, 1e-6
#: Allowed distance from the exact map on the finest triangulation, relative to its radius.
POSITION_ERROR = 0.01

_INVARIANT = ("angle_error_mean_deg", "angle_error_sd_deg", "dilatation_mean")


@dataclass(frozen=True)
class RefinementSeries:
    """The maps of one surface on triangulations from coarse to fine."""

    surface: surfaces.RefinedSurface
    maps: tuple[CheckedMap, ...]

    @property
    def order_scale(self) -> list[float]:
        """Relative triangle sizes h."""
        return [float(m.mesh.m) ** -0.5 for m in self.maps]


def examine_correctness(solver: Solver, registry: Registry) -> list[ValidationFinding]:
    """Return the findings; if a surface has no map at all, only that finding."""
    kind = surfaces.mesh_kind(solver.algorithm)
    series = [
        RefinementSeries(refined, tuple(solver.map(mesh) for mesh in refined.meshes))
        for refined in surfaces.refined(registry, kind)
    ]
    uneven = solver.map(surfaces.uneven(registry, kind))
    maps = [*(m for one in series for m in one.maps), uneven]
    findings = [maps_known_surfaces(maps)]
    if not findings[0].ok:
        return findings
    findings += [keeps_orientation(maps), *boundary_findings(solver.algorithm, maps), folds(maps)]
    findings += list(_invariances(solver, uneven))
    limits: list[ValidationFinding] = []
    for one in series:
        limits += [energy_vanishes(one), angles_improve(one)]
        if solver.algorithm.target == "disk":
            limits.append(keeps_the_modulus(one))
        if one.surface.exact_map is not None and solver.algorithm.target != "free boundary":
            limits.append(reaches_the_exact_map(one))
    return findings + (
        limits if solver.algorithm.conformal else [as_information(f) for f in limits]
    )


def as_information(finding: ValidationFinding) -> ValidationFinding:
    """Return the finding as information only, for algorithms that promise no conformal limit."""
    if finding.ok:
        return finding
    measured = f"{finding.measured}; it does not promise a conformal map"
    return finding.model_copy(update={"ok": True, "measured": measured})


def maps_known_surfaces(maps: Sequence[CheckedMap]) -> ValidationFinding:
    """Check that each closed-form surface is mapped."""
    bad = [f"{_named(m)}: {m.outcome.status}: {m.outcome.cause}" for m in maps if m.uv is None]
    return _finding("maps known surfaces", "; ".join(bad) or f"all {len(maps)}", ok=not bad)


def keeps_orientation(maps: Sequence[CheckedMap]) -> ValidationFinding:
    """Check that triangles stay counter-clockwise in the plane."""
    mirrored = [_named(m) for m in maps if image_area(m.mesh, _uv(m)) <= 0]
    measured = f"the map is mirrored on {', '.join(mirrored)}" if mirrored else "kept"
    return _finding("orientation", measured, ok=not mirrored)


def boundary_findings(
    algorithm: Algorithm, maps: Sequence[CheckedMap]
) -> Iterator[ValidationFinding]:
    """Yield checks that the boundary lies where the target says; none for a free boundary."""
    if algorithm.target == "free boundary":
        return
    round_holes = algorithm.target == "circular holes"
    off = [_off_circles(m) if round_holes else _off_circle(m) for m in maps]
    worst = int(np.argmax(off))
    allowed = CIRCULAR if round_holes else CIRCLE_TOLERANCE
    ok = off[worst] <= allowed
    where = "" if ok else f", on {_named(maps[worst])}"
    yield _finding(
        "boundary",
        f"up to {off[worst]:.1e} off the circle{where}",
        ok=ok,
        holes=", holes on circles" if round_holes else "",
        within=allowed,
    )


def folds(maps: Sequence[CheckedMap]) -> ValidationFinding:
    """Check for folded triangles on surfaces that can be mapped without."""
    counts = [(flipped_triangles(m.mesh, _uv(m)), m) for m in maps]
    bad = [f"{count} of {m.mesh.m} triangles folded on {_named(m)}" for count, m in counts if count]
    more = f" and {len(bad) - 2} more" if len(bad) > 2 else ""
    return _finding("folds", "; ".join(bad[:2] or ["none"]) + more, ok=not bad)


def energy_vanishes(series: RefinementSeries) -> ValidationFinding:
    """Check that E_C, relative to the area, tends to zero under refinement."""
    energies = [_relative_energy(m) for m in series.maps]
    return _rate(series, "E_C", energies, ENERGY_ORDER, ENERGY_ROUNDING)


def angles_improve(series: RefinementSeries) -> ValidationFinding:
    """Check that the mean angle error falls under refinement."""
    errors = [float(angle_errors(m.mesh, _uv(m)).mean()) for m in series.maps]
    return _rate(series, "angle error", errors, ANGLE_ORDER, ANGLE_ROUNDING)


def _rate(
    series: RefinementSeries, what: str, errors: list[float], least: float, rounding: float
) -> ValidationFinding:
    order, shown = _order(series, errors), ", ".join(f"{error:.2g}" for error in errors)
    return _finding(
        f"{what} under refinement",
        f"on {series.surface.name} {shown}: order {order:.2f}",
        surface=series.surface.name,
        orders=(order, least),
        ok=order >= least or max(errors) <= rounding,
        least=least,
    )


def reaches_the_exact_map(series: RefinementSeries) -> ValidationFinding:
    """Check the distance from the closed-form map, after the best Moebius map."""
    exact = series.surface.exact_map
    if exact is None:
        raise ValueError(f"{series.surface.name} has no known closed-form map")
    errors = [distance(_uv(m), exact(m.mesh.V), moebius=True) for m in series.maps]
    return _finding(
        "exact map",
        f"on {series.surface.name} {', '.join(f'{e:.2g}' for e in errors)} away: order "
        f"{_order(series, errors):.2f}",
        surface=series.surface.name,
        ok=errors[-1] <= POSITION_ERROR,
        within=POSITION_ERROR,
    )


def keeps_the_modulus(series: RefinementSeries) -> ValidationFinding:
    """Check the modulus of four boundary points against the surface's error certificate."""
    pairs = [(certify(_disk(m.mesh)), _uv(m)) for m in series.maps]
    off = [exact.off(uv[exact.corners]) for exact, uv in pairs]
    finest, uv = pairs[-1]
    return _finding(
        "modulus",
        f"on {series.surface.name} off by {', '.join(f'{o:+.1e}' for o in off)}; "
        f"reciprocal error {', '.join(f'{c.reciprocal_error:.1e}' for c, _ in pairs)}",
        ok=finest.encloses(uv[finest.corners]),
        surface=series.surface.name,
        lower=finest.lower,
        upper=finest.upper,
    )


def _disk(mesh: TriangleMesh) -> DiskMesh:
    if not isinstance(mesh, DiskMesh):
        raise TypeError(f"{mesh.name} is not a disk")
    return mesh


def _invariances(solver: Solver, uneven: CheckedMap) -> Iterator[ValidationFinding]:
    renumbered, number = surfaces.renumbered(uneven.mesh)
    similarity = solver.algorithm.target == "free boundary"
    again = solver.map(renumbered)
    uv = None if again.uv is None else again.uv[number]
    yield same_map("another numbering", uneven, again, uv, moebius=not similarity)
    moved = solver.map(surfaces.moved(uneven.mesh))
    yield same_map("rotation, shift, scale", uneven, moved, moved.uv, moebius=not similarity)
    yield same_under_backslash(uneven, solver.map(uneven.mesh, solves="backslash"))


def same_map(
    what: str, first: CheckedMap, second: CheckedMap, uv: Complex | None, *, moebius: bool
) -> ValidationFinding:
    """Check that the map or its figures are the same if the surface is given differently.

    `uv` is the second map in the numbering of the first. Maps are equal up to a Moebius map of
    the disk, or a similarity for a free boundary.
    """
    measured, ok = f"{second.outcome.status}: {second.outcome.cause}", False
    if uv is not None:
        figures = _largest_difference(first, second)
        apart = distance(uv, _uv(first), moebius=moebius)
        ok = min(figures, apart) <= SAME_FIGURES
        measured = f"figures differ by {figures:.1e}, maps by {apart:.1e}"
    return _finding(what, measured, ok=ok, within=SAME_FIGURES)


def same_under_backslash(reused: CheckedMap, anew: CheckedMap) -> ValidationFinding:
    """Check that both linear-algebra policies give the same map."""
    apart = np.inf
    if anew.uv is not None:
        apart = float(np.abs(_uv(reused) - anew.uv).max())
    measured = f"reuse and backslash differ by up to {apart:.1e}"
    if anew.uv is None:
        measured = f"{anew.outcome.status}: {anew.outcome.cause}"
    return _finding("both linear-algebra policies", measured, ok=apart <= SAME_MAP, within=SAME_MAP)


def _largest_difference(first: CheckedMap, second: CheckedMap) -> float:
    """Return the largest relative difference of figures that motion, numbering and scale keep."""
    mine, other = all_metrics(first.mesh, _uv(first)), all_metrics(second.mesh, _uv(second))
    energies = relative_energy(mine), relative_energy(other)
    if energies[0] is None or energies[1] is None:
        return np.inf  # a map to a point or a line
    apart = [abs(mine[name] - other[name]) / max(abs(mine[name]), 1e-300) for name in _INVARIANT]
    folds = float(mine["flipped_triangles"] != other["flipped_triangles"])
    return float(max(*apart, abs(energies[0] - energies[1]), folds))


def _order(series: RefinementSeries, errors: Sequence[float]) -> float:
    """Return the slope of log(error) against log(h)."""
    heights = np.log(np.maximum(errors, 1e-300))
    return float(np.polyfit(np.log(series.order_scale), heights, 1)[0])


def _relative_energy(mapped: CheckedMap) -> float:
    found = relative_energy(all_metrics(mapped.mesh, _uv(mapped)))
    return np.inf if found is None else abs(found)  # the area of a mirrored map is negative


def _off_circle(mapped: CheckedMap) -> float:
    uv = _uv(mapped)
    outer = max(mapped.mesh.loops, key=lambda loop: float(np.abs(uv[loop]).max()))
    return float(np.abs(np.abs(uv[outer]) - 1).max())


def _off_circles(mapped: CheckedMap) -> float:
    return max(_off_circle(mapped), boundary_circularity(mapped.mesh, _uv(mapped)))


def _uv(mapped: CheckedMap) -> Complex:
    if mapped.uv is None:
        raise ValueError(f"there is no map of {mapped.mesh.name}")
    return mapped.uv


def _named(mapped: CheckedMap) -> str:
    return f"{mapped.mesh.name} ({mapped.mesh.m:,} triangles)"
