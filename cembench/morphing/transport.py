"""The inverse of a map: locate points of the disk on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Ints = NDArray[np.int64]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class BarycentricPlaces:
    """Points in triangles: `faces` (p,) and barycentric coordinates `weights` (p, 3)."""

    faces: Ints
    weights: Real

    def carry(self, F: Ints, values: Real) -> Real:
        """Return values at vertices (n, ...) interpolated at these places, (p, ...)."""
        carried: Real = np.einsum("pc,pc...->p...", self.weights, values[F[self.faces]])
        return carried


def locate(uv: Complex, F: Ints, boundary: Ints, points: Complex) -> BarycentricPlaces:
    """Locate points in the triangles of a map without folds.

    A bounding-box tree (libigl's AABB) finds the triangle. A point between the unit circle and the
    chord of a boundary edge is moved to that chord along its ray from the centre.

    Parameters
    ----------
    uv : complex128 (n,)
        The map to the unit disk; no triangle is folded.
    F : int64 (m, 3)
        Triangles.
    boundary : int64 (b,)
        The boundary loop, counter-clockwise.
    points : complex128 (p,)
        Points in the closed unit disk.

    """
    import igl  # slow to load

    inward = _inside_polygon(uv[boundary], points)
    plane = _lifted(uv)
    _, faces, _ = igl.point_mesh_squared_distance(_lifted(inward), plane, F)
    faces = np.asarray(faces, dtype=np.int64)
    return BarycentricPlaces(faces, _barycentric(uv, F[faces], inward))


def _lifted(z: Complex) -> Real:
    # The library searches in space; its search in the plane is not faster.
    return np.stack([z.real, z.imag, np.zeros(len(z))], axis=1)


def _inside_polygon(corners: Complex, points: Complex) -> Complex:
    """Return the points, with those outside the polygon moved towards 0 onto its edge."""
    angles = np.unwrap(np.angle(corners))
    first = angles[0]
    turn = first + np.mod(np.angle(points) - first, 2 * np.pi)
    k = np.clip(np.searchsorted(angles, turn, side="right") - 1, 0, len(corners) - 1)
    a, b = corners[k], np.roll(corners, -1)[k]
    # On the ray through p, t p with t = cross(a, b - a) / cross(p, b - a) lies on the line a b.
    across = np.imag(np.conj(points) * (b - a))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.imag(np.conj(a) * (b - a)) / across
    return np.where(np.isfinite(t) & (t > 0) & (t < 1), t, 1.0) * points


def _barycentric(uv: Complex, faces: Ints, points: Complex) -> Real:
    a, b, c = (uv[faces[:, k]] for k in range(3))
    doubled = np.imag(np.conj(b - a) * (c - a))
    second = np.imag(np.conj(points - a) * (c - a)) / doubled
    third = np.imag(np.conj(b - a) * (points - a)) / doubled
    weights = np.clip(np.stack([1 - second - third, second, third], axis=1), 0.0, 1.0)
    return weights / weights.sum(axis=1, keepdims=True)
