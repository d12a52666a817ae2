"""Judge whether a valid map is far from conformal for its mesh, and say why.

How small angle errors can be depends on the mesh: on its edges, and on how much the conformal
factor must vary. So a map is compared with another map of the same mesh to the same kind of domain,
computed without iterations: the harmonic map with the boundary placed by harmonic measure. In the
continuum it is the conformal map itself. Where a disk is no place for the surface that map is as
bad; so large angle errors are also compared with those of a free boundary.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_energy import EnergyModel, in_gauge
from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.even_weights import evened
from cembench.conformal.filled_start import arcs_of_measure, widest_start
from cembench.conformal.free_boundary import pinned_map, two_distant_vertices
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import by_rows, laplacian, laplacian_of_weights
from cembench.conformal.metrics import (
    MapFigures,
    angle_errors,
    corner_angles,
    flipped_triangles,
)
from cembench.conformal.planar import polygon_area, signed_areas
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.errors import AlgorithmFailed
from cembench.core.notices import Notice, NoticeKind
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.cut import cut_open
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh, definition_1_notices
from cembench.registry import load_registry

#: A map with a mean angle error above this multiple of the yardstick's is far from conformal.
FAR = 2.0
#: Below this mean angle error, in degrees, none is, so a large smooth surface needs no yardstick.
CLOSE = 0.25
#: So is a map above this share of the mean angle error of collapsed triangles, or above this number
#: of degrees; the yardstick may be as bad there.
COLLAPSED, POOR = 0.25, 10.0
#: Above this number of degrees a map is also compared with a free boundary, and is far from
#: conformal above this multiple of its mean angle error; not on larger surfaces, to save memory.
COMPARED, FAR_FROM_FREE, MAX_TRIANGLES = 5.0, 4.0, 1_000_000
#: A triangle is crowded if its image is below this share of the mean image area; crowding is named
#: as a cause above this share of crowded triangles.
CROWDED_AREA, CROWDED_SHARE = 1e-6, 0.02
#: A step of best is tried on surfaces of at most so many triangles.
QUICK = 50_000
#: The candidate of best that is run to compare with, on disks of at most so many triangles.
NEXT, QUICK_RUN = "cetm-flips", 10_000
TRY_BEST = "-a best, which tries several algorithms"
#: Needles are named as a cause above this share of triangles with an angle below so many degrees.
NEEDLES, THIN = 0.04, 5.0
#: A note says what a repair of folds costs from so many degrees on.
COSTLY = 1.0
#: Other parameters are better if the mean angle error with them is below this share.
BETTER = 0.9


def quality_notes(target: str, figures: MapFigures, extras: Mapping[str, Any]) -> list[Notice]:
    """Return remarks on a valid map that is far from conformal; empty for others."""
    mesh, uv, error = figures.mesh, figures.uv, float(figures.angle_errors.mean())
    notes = _last_resort(mesh, extras, error)
    if extras.get("stopped") == "crowded":
        message = (
            "the iteration ended early because the boundary is too crowded: this is not the map "
            "of least energy"
        )
        notes.append(Notice(NoticeKind.CROWDED_BOUNDARY, message))
    if target not in ("disk", "circular holes") or error <= CLOSE:
        return notes
    known = yardstick(target, figures)
    reachable = np.inf if known is None else float(figures.angle_errors_of(known).mean())
    free, tried = free_map(mesh) if error > COMPARED else (np.inf, "")
    most = FAR * reachable, FAR_FROM_FREE * free, COLLAPSED * collapsed_error(figures), POOR
    if error <= min(most):
        return notes
    causes, advice = "; ".join(likely_causes(mesh, uv, extras)), ""
    if error > FAR * reachable:
        rival, by, advice = next_candidate(mesh), f"by {NEXT}", TRY_BEST
        if rival >= error:
            rival, by, advice = reachable, "with its boundary by harmonic measure", ""
        compared = f"but it can be {rival:.2f} {by}"
        causes = causes or "the method, not the mesh"
    elif error > FAR_FROM_FREE * free:
        compared = f"but with a free boundary, as of {tried}, it is {free:.2g}"
        causes = "the surface is too long, or its mesh too coarse, for this domain"
        advice = "--target plane, if the boundary may be free"
    else:
        others = {f"by {NEXT}": next_candidate(mesh), "with a free boundary (lscm)": free}
        named = [f"{name} {one:.2f}" for name, one in others.items() if one < np.inf]
        compared = "; ".join(named) or "and no other map was computed"
        causes = causes or "the mesh is too coarse"
    text = (
        f"far from conformal: the mean angle error is {error:.2f} degrees, {compared}. Likely "
        f"cause: {causes}. Take {advice or _better(target, figures)}"
    )
    return [*notes, Notice(NoticeKind.FAR_FROM_CONFORMAL, text)]


def _better(target: str, figures: MapFigures) -> str:
    """Return which algorithm to try, and what a step of it makes of a small disk's map."""
    mesh = figures.mesh
    if target != "disk" or not isinstance(mesh, DiskMesh):
        return "-a best-holes, or --target plane"
    if mesh.m > QUICK:
        return TRY_BEST
    uv, steps = evened(mesh, angle_gauge(mesh, figures.uv), 1)
    better = float(figures.angle_errors_of(uv).mean())
    return f"{TRY_BEST}: its first step brings this map to {better:.2f}" if steps else TRY_BEST


def next_candidate(mesh: TriangleMesh) -> float:
    """Return the mean angle error of :data:`NEXT`; infinite where it is not run or not valid."""
    if not isinstance(mesh, DiskMesh) or mesh.m > QUICK_RUN:
        return np.inf
    try:
        uv = load_registry().algorithm(NEXT).function(mesh).uv
    except AlgorithmFailed:
        return np.inf
    return np.inf if flipped_triangles(mesh, uv) else float(angle_errors(mesh, uv).mean())


def _last_resort(mesh: TriangleMesh, extras: Mapping[str, Any], error: float) -> list[Notice]:
    """Return a remark on what a method's last resort did, and what that cost."""
    if wanted := extras.get("instead_of"):
        tried = {name: why for name, why in extras["tried"].items() if name != extras["chosen"]}
        causes = "; ".join(f"{name}: {_why_not(why)}" for name, why in tried.items())
        chosen = extras["chosen"]
        message = f"{wanted} is not valid here, or worse ({causes}), so this is that of {chosen}"
        return [Notice(NoticeKind.LAST_RESORT, message)]
    done, before = extras.get("last_resort"), extras.get("before_repair", {})
    folded, failure = extras.get("folded_before_repair"), extras.get("failure")
    own = f"failed ({failure})" if failure else f"has {folded:,} folds" if folded else "is crowded"
    without = before.get("angle_error_mean_deg")
    cost = "" if without is None else f" instead of {without:.2f}"
    if not done and (without is None or error < without + COSTLY):
        return []
    if not done:
        message = (
            f"the method's own map {own}, and their repair costs {error - without:.2f} degrees: "
            f"the mean angle error is {error:.2f}{cost}"
        )
        return [Notice(NoticeKind.LAST_RESORT, message)]
    if "opened_holes" in done:
        crosses = f"has {folded:,} folds" if folded else "has boundaries that cross"
        message = (
            f"the method's own map {crosses}, so this one is its last resort: the surface was "
            f"mapped with its holes filled, and {done['opened_holes']:,} circles were cut out of "
            f"that map; the mean angle error is {error:.2f} degrees{cost}"
        )
        return [Notice(NoticeKind.LAST_RESORT, message)]
    message = (
        f"the method's own map {own}, so this one is its last resort: "
        f"{done['moved_boundary_vertices']:,} boundary vertices were moved, and mean value weights "
        f"placed {done['mean_value_vertices']:,} vertices; the mean angle error is {error:.2f} "
        f"degrees{cost}"
    )
    if done["mean_value_vertices"] == len(mesh.interior):
        free, by = free_map(mesh)
        if free < error:
            message += (
                ". The surface may be too long for one disk: a free boundary has room for it, as "
                f"of --target plane; {by} reaches {free:.2g}"
            )
    return [Notice(NoticeKind.LAST_RESORT, message)]


def _why_not(tried: Any) -> str:
    """Return what an algorithm that chooses says of a map that it did not choose."""
    return tried if isinstance(tried, str) else f"{tried['angle_error_mean_deg']:.2f} degrees"


def better_parameters(
    name: str, mesh: TriangleMesh, uv: Complex, other: Complex, parameters: Mapping[str, Any]
) -> list[Notice]:
    """Return a remark if the map `other`, made with these parameters, has much better angles."""
    own_error, other_error = (float(angle_errors(mesh, z).mean()) for z in (uv, other))
    if other_error >= BETTER * own_error or flipped_triangles(mesh, other) > flipped_triangles(
        mesh, uv
    ):
        return []
    named = " ".join(f"-p {name}.{key}={value}" for key, value in parameters.items())
    message = (
        f"the mean angle error is {own_error:.3g} degrees; with {named}, which the algorithm "
        f"suggests for this surface, it is {other_error:.3g}"
    )
    return [Notice(NoticeKind.BETTER_PARAMETERS, message)]


def collapsed_error(figures: MapFigures) -> float:
    """Return the mean angle error of a map that collapses all triangles, in degrees.

    A collapsed triangle has the angles 0, 0 and 180 degrees, so its mean error is two thirds of
    what its largest angle lacks to 180.
    """
    largest = figures.surface_angles.max(axis=1)
    return float((180 - largest).mean()) * 2 / 3


def likely_causes(mesh: TriangleMesh, uv: Complex, extras: Mapping[str, Any]) -> list[str]:
    """Return properties of the mesh or the method that can explain large angle errors."""
    causes = []
    needles = float((corner_angles(mesh.V, mesh.F).min(axis=1) < THIN).mean())
    if needles > NEEDLES:
        causes.append(f"needles ({needles:.0%} of the triangles have an angle below {THIN:g})")
    elif definition_1_notices(mesh.F, mesh.n, mesh.loops):
        causes.append("ears or pinches of the mesh (it breaks Definition 1)")
    repairs = extras.get("fold_repairs")
    if repairs:
        causes.append(f"folds were repaired ({repairs} solves)")
    areas = np.abs(signed_areas(uv, mesh.F))
    crowded = float((areas < CROWDED_AREA * areas.mean()).mean())
    if crowded > CROWDED_SHARE:
        causes.append(f"crowding ({crowded:.0%} of the triangles have almost no area left)")
    return causes


def free_map(mesh: TriangleMesh) -> tuple[float, str]:
    """Return the mean angle error of a map with a free boundary, in degrees, and how to get it.

    It is the map of least E_C by the surface's triangles or by the intrinsic Delaunay ones (LSCM),
    of a surface with holes that of the disk it is cut into: one factorisation each. Infinite where
    it has folds, where it cannot be computed, and above :data:`MAX_TRIANGLES`.
    """
    best = np.inf, ""
    if not isinstance(mesh, DiskMesh | HoledMesh) or mesh.m > MAX_TRIANGLES:
        return best
    disk, cut = (mesh, "") if isinstance(mesh, DiskMesh) else (cut_open(mesh).mesh, "--cut ")
    pins = two_distant_vertices(disk)
    for delaunay, option in ((False, ""), (True, " -p delaunay=true")):
        try:
            uv = pinned_map(laplacian(disk, delaunay=delaunay), disk.loops, pins)
        except AlgorithmFailed:
            continue
        error = float(angle_errors(disk, uv).mean())
        if not flipped_triangles(disk, uv) and error < BETTER * best[0]:
            best = error, f"{cut}-a lscm{option}"
    return best


def yardstick(target: str, figures: MapFigures) -> Complex | None:
    """Return the map (n,) of the same target to compare with; None if there is none.

    For a surface with holes, it has the same outer boundary as the map of the figures.
    """
    mesh, uv = figures.mesh, figures.uv
    try:
        if target == "disk" and isinstance(mesh, DiskMesh):
            return _by_harmonic_measure(mesh, figures.half_cotangents)
        if target == "circular holes" and isinstance(mesh, HoledMesh):
            return _by_filled_start(mesh, max(mesh.loops, key=lambda loop: polygon_area(uv[loop])))
    except AlgorithmFailed:
        return None
    return None


def _by_harmonic_measure(mesh: DiskMesh, half_cotangents: Real) -> Complex:
    L = by_rows(laplacian_of_weights(mesh.F, half_cotangents, mesh.n))
    i, b = mesh.interior, mesh.boundary
    if not len(i):
        raise AlgorithmFailed("the mesh has no interior vertex")
    L_bi, inside = L[b][:, i], Cholesky(L[i][:, i].tocsc())
    measure = gauge_measure(mesh, "triangle", b)
    seen = measure[b] - L_bi @ inside.solve(measure[i])
    arcs = CircleDomain.of_arcs(arcs_of_measure(seen, edge_lengths(mesh, b))).arcs
    uv = np.empty(mesh.n, dtype=np.complex128)
    uv[b] = np.exp(1j * (np.cumsum(arcs) - arcs))
    uv[i] = inside.solve(-(L_bi.T @ uv[b]))
    return uv


def _by_filled_start(mesh: HoledMesh, outer: Indices) -> Complex:
    outer, holes = mesh.outer_and_holes(int(outer[0]))
    loops = (outer, *holes)
    bordered = BorderedLaplacian(mesh, laplacian(mesh), loops)
    S = bordered.dirichlet_to_neumann()
    measures = [gauge_measure(mesh, name, outer) for name in ("triangle", "boundary")]
    seen, weights = bordered.swept_to_boundary(np.stack(measures, axis=1)).T
    start = widest_start(S, seen, [edge_lengths(mesh, loop) for loop in loops])
    if start.rims.outer:
        start = start.inside_out(0)
    domains = (start, in_gauge(start, weights))
    best = min(domains, key=lambda domain: EnergyModel(S, domain, weights).energy)
    return bordered.harmonic_extension(best.points)
