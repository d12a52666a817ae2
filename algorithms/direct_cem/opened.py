"""A valid map to a disk with circular holes, from one of the filled surface.

The surface with its holes filled by fans is a disk, and a disk has a valid map (`last_resort`). In
it the image of each hole is a polygon that the fan's centre sees whole. So every vertex of the hole
can move towards that centre, onto a circle inside the polygon: no order changes, and the triangles
around the hole grow. Those that fold all the same are laid out again, or the circle shrinks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cembench.conformal.fold_repair import accepted_repair, figures
from cembench.conformal.folds import interior_without_folds
from cembench.conformal.metrics import (
    CIRCULAR,
    angle_errors,
    boundary_circularity,
    flipped_triangles,
)
from cembench.conformal.patches import filled
from cembench.conformal.planar import crossing_polygons, fitted_circle, folded_triangles
from cembench.core.arrays import Complex, Loop
from cembench.core.clock import phase
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import HoledMesh

from .disk import direct_cem

#: Radii of the circles that are tried, as shares of the largest about the centre in the polygon;
#: with 0 the polygon stays.
SHARES = np.array([0.9, 0.3, 0.0])
#: Rings of vertices around folds that are laid out again about a circle.
RINGS = (1, 2, 4)
#: Patches are no remedy if more than this share of the triangles fold.
MAX_FOLDED = 0.01
#: Circles as exact as this, and as far apart, do not meet.
ROUND = 1e-6
#: Of two equally valid maps the last resort's is taken only if its error is below this share of
#: the other's: its radii are further from the conformal ones than those of a repaired map.
GAIN = 0.9


def valid_with_holes(
    mesh: HoledMesh, loops: Sequence[Loop], own: Complex, *, repair: bool, last_resort: bool
) -> tuple[Complex, dict[str, Any]]:
    """Repair a map to a disk with circular holes; at last, take one of the filled surface.

    Parameters
    ----------
    mesh : HoledMesh
        The surface.
    loops : sequence of int64 arrays
        Its outer boundary and its holes, with the surface on their left.
    own : complex (n,)
        Its map as the method made it.
    repair : bool
        Whether to do anything; if not, `own` is returned.
    last_resort : bool
        Whether to compare the map with that of :func:`opened_disk` if `own` has folds or crossing
        boundaries: they may stay, and a repair can cost angles.

    Returns
    -------
    z : complex (n,)
        The map with the fewest folds, then without crossing boundaries, then with round holes,
        then with the least mean angle error; the opened disk must have a tenth less (`GAIN`).
    extras : dict
        As for :func:`cembench.conformal.fold_repair.accepted_repair`. If the opened disk is the
        map, ``last_resort`` has ``opened_holes``, their number.
    """
    with phase("folds"):
        folded = flipped_triangles(mesh, own)
        turned = _with_ears_turned(mesh, loops[1:], own) if folded and repair else own
    last_resort = last_resort and repair
    in_patches = folded <= MAX_FOLDED * mesh.m or not last_resort
    repaired, extras = accepted_repair(mesh, turned, repair=repair and in_patches)
    extras["folded_before_repair"] = folded
    extras["fold_repairs"] += int(turned is not own)
    if not last_resort or not (folded or _cross(own, loops)):
        return repaired, extras
    extras["before_repair"] = figures(mesh, own, folded)
    with phase("folds"):
        cost = _cost(mesh, loops, repaired)
    opened = opened_disk(mesh, loops[1:])
    with phase("folds"):
        *faults, error = _cost(mesh, loops, opened)
        if (*faults, error / GAIN) < cost:
            extras["fold_repairs"] += 1
            return opened, extras | {"last_resort": {"opened_holes": len(loops) - 1}}
    return repaired, extras


def opened_disk(mesh: HoledMesh, holes: Sequence[Loop]) -> Complex:
    """Map the filled surface to the disk, and move each hole to a circle about its fan's centre.

    Parameters
    ----------
    mesh : HoledMesh
        The surface.
    holes : sequence of int64 arrays
        Its holes, with the surface on their left.

    Returns
    -------
    complex (n,)
        The map. A hole keeps its polygon where a circle leaves folds, as it does where an edge
        inside the surface joins two of the hole's vertices.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> z = opened_disk(ring, ring.outer_and_holes()[1])
    >>> flipped_triangles(ring, z)
    0
    """
    disk = direct_cem(filled(mesh, holes)).uv
    of = _holes_of(mesh, holes)
    graph = vertex_graph(mesh.F, mesh.n)
    tries = np.zeros(len(holes), dtype=np.int64)
    while True:
        z = disk[: mesh.n].copy()
        for centre, hole, share in zip(disk[mesh.n :], holes, SHARES[tries], strict=True):
            if share:
                spokes = z[hole] - centre
                z[hole] = centre + share * _room(spokes) * spokes / np.abs(spokes)
        z = _with_ears_turned(mesh, [holes[k] for k in np.flatnonzero(SHARES[tries]).tolist()], z)
        z, _ = interior_without_folds(mesh, z, RINGS)
        near = np.zeros(mesh.n)
        near[mesh.F[folded_triangles(z, mesh.F)]] = 1
        concerned = np.unique(of[(near + graph @ near > 0) & (of >= 0)])
        concerned = concerned[tries[concerned] < len(SHARES) - 1]
        if not len(concerned):
            return z
        tries[concerned] += 1


def _holes_of(mesh: HoledMesh, holes: Sequence[Loop]) -> Loop:
    """Return which hole each vertex is on, (n,); -1 for none."""
    of = np.full(mesh.n, -1)
    for k, hole in enumerate(holes):
        of[hole] = k
    return of


def _room(spokes: Complex) -> float:
    """Return the radius of the largest circle about 0 inside a polygon that 0 sees whole."""
    sides = np.roll(spokes, -1) - spokes
    nearest = np.clip(-(spokes.conj() * sides).real / np.abs(sides) ** 2, 0, 1)
    return float(np.abs(spokes + nearest * sides).min())


def _with_ears_turned(mesh: HoledMesh, holes: Sequence[Loop], z: Complex) -> Complex:
    """Mirror the tips of triangles with two sides on a hole in their third side.

    A triangle with all corners on a hole's circle lies inside it; its tip must leave the circle.
    """
    of = _holes_of(mesh, holes)
    corners = of[mesh.F]
    all_on_one = (corners[:, 0] >= 0) & (np.ptp(corners, axis=1) == 0)
    turned = z.copy()
    for triangle in mesh.F[all_on_one]:
        loop = holes[of[triangle[0]]]
        place = {int(v): int(np.flatnonzero(loop == v)[0]) for v in triangle}
        for k in range(3):
            tip, a, b = (int(triangle[(k + d) % 3]) for d in range(3))
            steps = {(place[v] - place[tip]) % len(loop) for v in (a, b)}
            if steps == {1, len(loop) - 1} and len(loop) > 3:
                side = z[b] - z[a]
                turned[tip] = z[a] + side * np.conj((z[tip] - z[a]) / side)
    return turned if len(folded_triangles(turned, mesh.F)) < len(folded_triangles(z, mesh.F)) else z


def _cross(z: Complex, loops: Sequence[Loop]) -> bool:
    """Whether boundaries meet each other or themselves in the image."""
    outer, *holes = (z[loop] for loop in loops)
    fitted = [fitted_circle(hole) for hole in holes]
    c, r = np.array([c for c, _ in fitted]), np.array([r for _, r in fitted])
    nearest = np.cos(np.abs(np.angle(np.roll(outer, -1) / outer)).max() / 2)
    gaps = np.abs(c[:, None] - c) - (r[:, None] + r)
    np.fill_diagonal(gaps, nearest - np.abs(c) - r)
    off = [np.abs(np.abs(hole - c[k]) / r[k] - 1).max() for k, hole in enumerate(holes)]
    if max(off) < ROUND and (gaps > ROUND).all():
        return False
    return crossing_polygons([outer, *holes]) is not None


def _cost(mesh: HoledMesh, loops: Sequence[Loop], z: Complex) -> tuple[int, bool, bool, float]:
    """Return the figures by which the better map is the smaller one."""
    unround = boundary_circularity(mesh, z) > CIRCULAR
    error = float(angle_errors(mesh, z).mean())
    return flipped_triangles(mesh, z), _cross(z, loops), unround, error
