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
from numpy.typing import NDArray

from cembench.conformal.fold_repair import accepted_repair, figures
from cembench.conformal.folds import interior_without_folds
from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.conformal.patches import filled
from cembench.conformal.planar import crossing_polygons
from cembench.core.clock import phase
from cembench.core.errors import MeshError
from cembench.mesh.triangle_mesh import HoledMesh

from .disk import direct_cem

Complex = NDArray[np.complex128]
Loop = NDArray[np.int64]

#: Radii of the circles that are tried, as shares of the largest about the centre in the polygon.
SHARES = (0.9, 0.5, 0.2)
#: Patches are no remedy if more than this share of the triangles fold.
MOST_FOLDED = 0.03


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
        Whether to take the map of :func:`opened_disk` where folds or crossing boundaries of `own`
        cannot be repaired, or only to angles that are worse.

    Returns
    -------
    z : complex (n,)
        The map with the fewest folds, then without crossing boundaries, then with the least mean
        angle error.
    extras : dict
        As for :func:`cembench.conformal.fold_repair.accepted_repair`. If the opened disk is the
        map, ``last_resort`` has ``opened_holes``, their number.

    """
    folded = flipped_triangles(mesh, own)
    last_resort = last_resort and repair
    in_patches = folded <= MOST_FOLDED * mesh.m or not last_resort
    repaired, extras = accepted_repair(mesh, own, repair=repair and in_patches)
    if not last_resort or not (folded or _cross(own, loops)):
        return repaired, extras
    extras["before_repair"] = figures(mesh, own, folded)
    try:
        opened = opened_disk(mesh, loops[1:])
    except MeshError:  # a fan has a triangle without area
        return repaired, extras
    with phase("folds"):
        if _cost(mesh, loops, opened) < _cost(mesh, loops, repaired):
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
        The map. It has folds if an edge inside the surface joins two vertices of a hole; such a
        surface has no map without.

    Raises
    ------
    MeshError
        A fan has a triangle without area.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> z = opened_disk(ring, ring.outer_and_holes()[1])
    >>> flipped_triangles(ring, z)
    0

    """
    disk = direct_cem(filled(mesh, holes)).uv
    maps = []
    for share in SHARES:
        z = disk[: mesh.n].copy()
        for centre, hole in zip(disk[mesh.n :], holes, strict=True):
            spokes = z[hole] - centre
            z[hole] = centre + share * _room(spokes) * spokes / np.abs(spokes)
        z, _ = interior_without_folds(mesh, z)
        maps.append((flipped_triangles(mesh, z), z))
        if not maps[-1][0]:
            break
    return min(maps, key=lambda one: one[0])[1]


def _room(spokes: Complex) -> float:
    """Return the radius of the largest circle about 0 inside a polygon that 0 sees whole."""
    sides = np.roll(spokes, -1) - spokes
    nearest = np.clip(-(spokes.conj() * sides).real / np.abs(sides) ** 2, 0, 1)
    return float(np.abs(spokes + nearest * sides).min())


def _cross(z: Complex, loops: Sequence[Loop]) -> bool:
    """Whether boundaries meet each other in the image."""
    return crossing_polygons([z[loop] for loop in loops]) is not None


def _cost(mesh: HoledMesh, loops: Sequence[Loop], z: Complex) -> tuple[int, bool, float]:
    """Return the figures by which the better map is the smaller one."""
    return flipped_triangles(mesh, z), _cross(z, loops), float(angle_errors(mesh, z).mean())
