"""Locate points of the plane on a surface through its map, and map the disk to the square."""

from __future__ import annotations

import numpy as np
from scipy import special

from cembench.core.arrays import Complex, Indices, Real

#: A point this close to a triangle, relative to the size of the map, lies in it.
_ROUNDING = 1e-14


def locate(
    z: Complex, F: Indices, points: Complex, *, nearest: bool = False
) -> tuple[Indices, Real]:
    """Find points of the plane in the image's triangles.

    Parameters
    ----------
    z, F : complex128 (n,), int64 (m, 3)
        A map and its triangles.
    points : complex128 (k,)
        Points of the plane.
    nearest : bool
        Whether to move a point outside to the nearest triangle, e.g. on the thin caps between the
        boundary polygon and the circle.

    Returns
    -------
    face : int64 (k,)
        The triangle; -1 for points outside.
    weights : float64 (k, 3)
        Barycentric coordinates, none negative.
    """
    import igl  # slow to load

    squared, face, near = igl.point_mesh_squared_distance(_in_space(points), _in_space(z), F)
    face = np.array(face, dtype=np.int64)
    weights = _weights(z[F[face]], near[:, 0] + 1j * near[:, 1])
    if not nearest:
        face[squared > (_ROUNDING * np.abs(z).max()) ** 2] = -1
    return face, weights


def interpolated(weights: Real, corners: Real) -> Real:
    """Return values (k, ...) interpolated in triangles, whose corners have `corners` (k, 3, ...).

    `weights` (k, 3) are barycentric coordinates, as :func:`locate` returns them.
    """
    return np.asarray(np.einsum("kc,kc...->k...", weights, corners))


def _in_space(z: Complex) -> Real:
    # The library searches in space; its search in the plane is not faster.
    return np.stack([z.real, z.imag, np.zeros(len(z))], axis=1)


def square_to_disk(w: Complex) -> Complex:
    """Map the square with corners (+-1, +-1) conformally to the unit disk; the centre stays.

    The map is an elliptic function of modulus 1/sqrt(2) [1]_; corners go to the diagonals.

    References
    ----------
    .. [1] H. A. Schwarz, "Ueber einige Abbildungsaufgaben", J. reine angew. Math. 70 (1869).
    """
    quarter = special.ellipk(0.5)
    u = quarter * ((1 + 1j) / 2 * w - 1)
    sn, cn, dn, _ = special.ellipj(u.real, 0.5)
    sn_i, cn_i, dn_i, _ = special.ellipj(u.imag, 0.5)
    value = (cn * cn_i - 1j * sn * dn * sn_i * dn_i) / (1 - (dn * sn_i) ** 2)
    return np.asarray((1 - 1j) / np.sqrt(2) * value)


def disk_to_square(z: Complex) -> Complex:
    """Map the unit disk conformally to the square with corners (+-1, +-1), as Schwarz did.

    It is the inverse of :func:`square_to_disk`: the integral of 1 / sqrt(1 + z^4), up to a factor.
    """
    value = z * special.hyp2f1(0.25, 0.5, 1.25, -(z**4)) / special.hyp2f1(0.25, 0.5, 1.25, -1.0)
    return np.asarray(value.real.clip(-1, 1) + 1j * value.imag.clip(-1, 1))


def _weights(corners: Complex, points: Complex) -> Real:
    """Return the barycentric coordinates of points, clipped to the triangle."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - a
    area = (np.conj(u) * v).imag
    safe = np.where(area == 0, 1.0, area)
    second, third = (np.conj(p) * v).imag / safe, (np.conj(u) * p).imag / safe
    weights = np.stack([1 - second - third, second, third], axis=1).clip(0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
