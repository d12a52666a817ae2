"""Patches that close a hole: triangles to its centroid, or a round disk glued in along its rim.

For a Dirichlet problem on the rest of the surface, a patch is only the energy of its harmonic
filling for values u on the rim, u^T P u / 2, with a dense symmetric matrix P (k, k) that is
positive semi-definite with the constants as its kernel.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from cembench.conformal.laplacian import half_cotangents, laplacian_of_weights
from cembench.core.arrays import Indices, Loop, Real
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

#: Height of a fan's triangle, as a share of its base, below which it has no area.
SLIM = 1e-9
#: Number of terms of the power series above rounding errors, for |x| <= pi.
_TERMS = 28


def fan(loop: Loop, centre: int) -> Indices:
    """Return the triangles (k, 3) that fill a hole from a centre, oriented like the surface.

    `loop` has the surface on its left, as in ``mesh.loops``.
    """
    return np.stack([np.roll(loop, -1), loop, np.full(len(loop), centre)], axis=1)


def filled(mesh: TriangleMesh, holes: Sequence[Loop]) -> DiskMesh:
    """Return the surface with each hole filled by a fan to its centroid; these vertices come last.

    Where a triangle of the fan would have no area, as in a slit, the centre is above the centroid
    by the mean length of the hole's edges.
    """
    rims = [mesh.V[hole] for hole in holes]
    centres = np.array([_centre(rim) for rim in rims]).reshape(-1, 3)
    fans = [fan(hole, mesh.n + k) for k, hole in enumerate(holes)]
    V, F = np.concatenate([mesh.V, centres]), np.concatenate([mesh.F, *fans])
    return DiskMesh.trusted(V, F, name=mesh.name)


def _centre(rim: Real) -> Real:
    """Return a point that sees the edges of a rim (k, 3) in triangles with an area."""
    centre: Real = rim.mean(axis=0)
    sides, spokes = np.roll(rim, -1, axis=0) - rim, rim - centre
    heights = np.linalg.norm(np.cross(sides, spokes), axis=1)
    if (heights > SLIM * (sides**2).sum(axis=1)).all():
        return centre
    off = np.linalg.svd(spokes)[2][-1]
    return centre + np.linalg.norm(sides, axis=1).mean() * off


def fan_patch(rim: Real) -> Real:
    """Return P of the fan over a rim (k, 2 or 3), with its centre eliminated.

    If the centroid lies on the line of an edge, so that angles are not defined, all edges of the
    fan get equal weights.
    """
    k = len(rim)
    V, F = np.concatenate([rim, rim.mean(axis=0, keepdims=True)]), fan(np.arange(k), k)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = half_cotangents(V, F)
    if not np.isfinite(weights).all():
        weights = np.ones_like(weights)
    L = laplacian_of_weights(F, weights, k + 1).toarray()
    spokes = L[:k, k]
    return L[:k, :k] - np.outer(spokes, spokes) / L[k, k]


def disk_patch(angles: Real) -> Real:
    """Return P of a round disk with rim vertices at these angles (k,), increasing within one turn.

    Exact for values that are linear in the angle between neighbours. With u' constant on arcs, u^T
    P u = -(1/pi) times the double integral of u'(s) u'(t) log abs(2 sin((s - t)/2)), of which a
    second antiderivative is known (`sum_of_cosines`). Up to that interpolation it is invariant
    under Moebius maps of the disk.
    """
    ends = np.append(angles, angles[0] + 2 * np.pi)
    table = sum_of_cosines(ends[:, None] - ends[None, :])
    arcs = (table[1:, 1:] - table[1:, :-1] - table[:-1, 1:] + table[:-1, :-1]) / np.pi
    lengths = np.diff(ends)
    slopes = arcs / np.outer(lengths, lengths)
    # u' is (u_next - u) / length on each arc: differences of rows and of columns.
    rows = np.roll(slopes, 1, axis=0) - slopes
    return np.roll(rows, 1, axis=1) - rows


def sum_of_cosines(x: Real) -> Real:
    """Return the sum over k >= 1 of (cos(k x) - 1) / k^3 to rounding errors, also for small x.

    Its second derivative is log abs(2 sin(x / 2)): x^2 (log x / 2 - 3 / 4) minus a power series in
    x^2 with coefficients abs(B_2k) / (2k (2k + 2)!), B the Bernoulli numbers.
    """
    x = np.abs(x) % (2 * np.pi)
    x = np.minimum(x, 2 * np.pi - x)
    squared = x * x
    rest = np.zeros_like(x)
    for term in _coefficients()[::-1]:
        rest = (rest + term) * squared
    log = np.log(np.where(x > 0, x, 1.0))
    return squared * (log / 2 - 0.75 - rest)


@cache
def _coefficients() -> Real:
    """Return the numbers |B_2k| / (2k (2k + 2)!) for k = 1, 2, ..."""
    from scipy.special import bernoulli, factorial

    k = np.arange(1, _TERMS + 1)
    return np.abs(bernoulli(2 * _TERMS)[2 * k]) / (2 * k * factorial(2 * k + 2))
