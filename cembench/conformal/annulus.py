"""The conformal map of a surface with one hole to a concentric annulus, by its logarithm.

Along a tube, a map to the disk shrinks exponentially: details at radius r add r^2 to E_C, and at
radius 1e-8 nothing that doubles hold. The logarithm maps the surface to a cylinder, where each ring
of the tube counts as much as any other. It is -h u + i v: u is harmonic, 0 on the outer boundary
and 1 on the hole; v is its conjugate, a harmonic angle that grows by 2 pi around the hole and is
free on the boundary; h = 2 pi / (u^T L u) makes the two conformal to each other (Gu and Yau 2008,
Computational Conformal Geometry, harmonic 1-forms).
"""

from __future__ import annotations

import numpy as np

from cembench.conformal.conjugate_functions import ConjugateFunctions, conjugate_functions
from cembench.conformal.folds import in_order
from cembench.core.arrays import Complex, Loop, Real
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import HoledMesh

#: Doubles hold the annulus with radii 1 and exp(-DEEPEST), and areas of triangles near the hole by
#: exact arithmetic.
DEEPEST = 700.0
#: An arc, in radians, above which the polygon of a boundary may not go around the centre.
WIDEST = 0.9 * np.pi


def annulus_map(mesh: HoledMesh, outer: Loop, hole: Loop) -> Complex:
    """Map a surface with one hole to the annulus exp(-h) <= |z| <= 1.

    Parameters
    ----------
    mesh : HoledMesh
        The surface.
    outer, hole : int64 arrays
        Its two boundary loops, with the surface on their left.

    Returns
    -------
    complex (n,)
        The map. Both boundaries are in order on their circles; triangles may be folded.

    Raises
    ------
    AlgorithmFailed
        A boundary does not go around its circle once, or the hole would be smaller than doubles
        hold.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> outer, (hole,) = ring.outer_and_holes()
    >>> z = annulus_map(ring, outer, hole)
    >>> bool(np.ptp(np.abs(z[hole])) < 1e-12)
    True
    """
    ring = conjugate_functions(mesh, outer, [hole])
    u, v, b = ring.u[:, 0], ring.v[:, 0], np.concatenate([outer, hole])
    lifted, paths = v[ring.cut.origin] + ring.jump[:, 0], _rims(ring, outer, hole)
    goals = _increasing(lifted[paths[0]]), -_increasing(-lifted[paths[1]])
    moved = np.concatenate(goals) - np.concatenate([lifted[path[:-1]] for path in paths])
    if np.abs(moved).max() > 0:
        by_vertex = np.zeros(mesh.n)
        by_vertex[np.concatenate([ring.cut.origin[path[:-1]] for path in paths])] = moved
        v = v + ring.extension(by_vertex[b])
    modulus = 2 * np.pi / float(ring.capacity[0, 0])
    if not modulus < DEEPEST:
        raise AlgorithmFailed(
            f"the hole's radius would be exp(-{modulus:.0f}), below what doubles hold: map the "
            "surface with a free boundary"
        )
    return np.exp(-modulus * u + 1j * v)


def _rims(pair: ConjugateFunctions, outer: Loop, hole: Loop) -> tuple[Loop, Loop]:
    """Return the boundaries on a cut annulus, each from one bank of the cut to the other."""
    b = pair.boundary
    on_hole = np.flatnonzero(np.isin(pair.cut.origin[b], hole))
    return b[: len(outer) + 1], b[on_hole[0] : on_hole[0] + len(hole) + 1]


def _increasing(angles: Real) -> Real:
    """Return the nearest angles (k,) in order, for the vertices of a circle; the last closes it.

    They are evenly spaced where neighbours would be so far apart that the polygon misses the
    centre.
    """
    arcs = np.diff(angles)
    if arcs.max() > WIDEST:
        return angles[0] + np.arange(len(arcs)) * 2 * np.pi / len(arcs)
    if arcs.min() > 0:
        return angles[:-1]
    circle = np.exp(1j * angles[:-1])
    moved: Real = np.angle(in_order(circle) / circle)
    return angles[:-1] + moved
