"""Initial maps of a closed surface of genus zero to the sphere, by way of the plane.

Angenent, Haker, Tannenbaum & Kikinis 1999: a map that is harmonic except at one triangle, whose
image in the plane surrounds all others; the plane is the sphere without its north pole.
"""

from __future__ import annotations

import numpy as np
import scipy

from cembench.conformal.harmonic import harmonic_extension
from cembench.core.arrays import Complex, Indices, Real


def balanced_planar_map(L: scipy.sparse.csc_array, V: Real, F: Indices) -> Complex:
    """Return the planar map (n,) from which a spherical map starts.

    L, V and F are those of a closed surface. One pole lies in its most regular triangle, and both
    poles are scaled alike.
    """
    outer = most_regular_triangle(V, F)
    return balanced(harmonic_around_triangle(L, V, F[outer]), F, outer)


def most_regular_triangle(V: Real, F: Indices) -> int:
    """Return the triangle whose sides are closest to equal; the first one in a tie."""
    sides = np.linalg.norm(V[F] - V[np.roll(F, 1, axis=1)], axis=2)
    share = sides / sides.sum(axis=1, keepdims=True)
    return int(np.argmin(np.abs(share - 1 / 3).sum(axis=1)))


def harmonic_around_triangle(L: scipy.sparse.csc_array, V: Real, triangle: Indices) -> Complex:
    """Return the planar map (n,) that is harmonic for L and keeps the shape of one triangle (3,).

    The triangle is counter-clockwise with its first side on [0, 1]; all others lie inside it,
    clockwise. Their mean vertex is then moved to 0.
    """
    a, b, c = V[triangle]
    side = b - a
    x = np.dot(c - a, side) / np.dot(side, side)
    y = np.linalg.norm(c - a - x * side) / np.linalg.norm(side)
    z: Complex = harmonic_extension(L, triangle, np.array([0, 1, x + 1j * y]))
    return z - z.mean()


def balanced(z: Complex, F: Indices, outer: int) -> Complex:
    """Scale a planar map so that both poles of the sphere look alike.

    The mean side of the triangle `outer` then equals that of the innermost other triangle seen from
    the other pole, where z is 1 / conj(z).
    """
    nearness = np.abs(z)[F].sum(axis=1)
    nearness[outer] = np.inf
    inner = z[F[np.argmin(nearness)]]
    far_side = _mean_side(z[F[outer]])
    # Seen from there, side pq of the inner triangle has the length |p - q| / |p q|.
    near = np.maximum(np.abs(inner), np.finfo(float).tiny)
    near_side = float((np.abs(inner - np.roll(inner, 1)) / near / np.roll(near, 1)).mean())
    return z * np.sqrt(near_side / far_side)


def _mean_side(corners: Complex) -> float:
    """Return the mean side length of a triangle."""
    return float(np.abs(corners - np.roll(corners, 1)).mean())
