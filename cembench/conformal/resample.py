"""Resample a surface through its map: geometry images, and meshes with equilateral triangles.

Both locate points of the plane on the surface. A conformal map preserves small shapes, so squares
and equilateral triangles of the plane are nearly squares and equilateral on the surface; their
sizes follow the scaling of the map.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy import special
from scipy.spatial import Delaunay

from cembench.core.arrays import Complex, Indices, Real
from cembench.core.errors import ParameterError
from cembench.mesh.defects import degenerate
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Grid = Literal["square", "disk"]

#: Allowed numbers of samples along a side.
LEAST, MOST = 4, 8192
#: Allowed distance of a disk map's boundary from the unit circle.
_ON_CIRCLE = 1e-9
#: A point this close to a triangle, relative to the size of the map, lies in it.
_ROUNDING = 1e-14


def geometry_image(mesh: TriangleMesh, z: Complex, side: int, grid: Grid = "square") -> Real:
    """Sample a surface on a regular grid of its map's domain.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    z : complex128 (n,)
        Its map.
    side : int
        Samples along a side of the grid, 4 to 8192.
    grid : {"square", "disk"}
        ``"square"`` maps the disk to the square, conformally except at the corners, so that the
        surface covers the whole grid; only for maps onto the disk. ``"disk"`` lays the grid over
        the map.

    Returns
    -------
    float64 (side, side, 3)
        Points of the surface; the first row is the top. NaN where the grid is off the surface.

    Raises
    ------
    ParameterError
        The side is out of range, or the map is not onto the disk.

    References
    ----------
    .. [1] X. Gu, S. Gortler, H. Hoppe, "Geometry images", SIGGRAPH 2002.

    """
    _check_side(side)
    if grid == "square":
        _check_disk(mesh, z)
        x = np.linspace(-1, 1, side)
        points = square_to_disk(x[None, :] + 1j * x[::-1, None])
    else:
        low = complex(z.real.min(), z.imag.min())
        extent = max(np.ptp(z.real), np.ptp(z.imag))
        middle = low + complex(np.ptp(z.real), np.ptp(z.imag)) / 2
        x = (np.arange(side) + 0.5) / side - 0.5
        points = np.asarray(middle + extent * (x[None, :] + 1j * x[::-1, None]))
    face, weights = locate(z, mesh.F, points.ravel(), nearest=grid == "square")
    pixels = np.full((side * side, 3), np.nan)
    inside = face >= 0
    pixels[inside] = interpolated(weights[inside], mesh.V[mesh.F[face[inside]]])
    return pixels.reshape(side, side, 3)


def regular_remesh(mesh: TriangleMesh, z: Complex, side: int) -> tuple[DiskMesh, Complex]:
    """Remesh a surface with triangles that are equilateral on its disk.

    A triangular lattice in the disk and evenly spaced points on its circle are joined by a Delaunay
    triangulation (Qhull) and lifted to the surface. The new triangles are large where the map
    shrinks the surface: a lattice that is even on the disk cannot be even on the surface too.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    z : complex128 (n,)
        Its map onto the unit disk.
    side : int
        Lattice points along the disk's diameter, 4 to 8192.

    Returns
    -------
    mesh : DiskMesh
        The new mesh; its vertices lie on triangles of the old one.
    z : complex128 (k,)
        Their positions in the disk.

    Raises
    ------
    ParameterError
        The side is out of range or too large for the surface, or the map is not onto the disk.

    """
    _check_side(side)
    _check_disk(mesh, z)
    step = 2 / (side - 1)
    rows = np.arange(-np.ceil(2 / step), np.ceil(2 / step) + 1)
    row, column = np.meshgrid(rows, rows, indexing="ij")
    lattice = (step * (column + row / 2 + 1j * row * np.sqrt(0.75))).ravel()
    inner = lattice[np.abs(lattice) < 1 - 0.6 * step]
    around = np.exp(2j * np.pi * np.arange(np.ceil(2 * np.pi / step)) / np.ceil(2 * np.pi / step))
    points = np.concatenate([around, inner])
    F = Delaunay(np.stack([points.real, points.imag], axis=1)).simplices.astype(np.int64)
    a, b, c = (points[F[:, k]] for k in range(3))
    clockwise = (np.conj(b - a) * (c - a)).imag < 0
    F[clockwise] = F[clockwise, ::-1]
    face, weights = locate(z, mesh.F, points, nearest=True)
    V = interpolated(weights, mesh.V[mesh.F[face]])
    if flat := np.count_nonzero(degenerate(V, F)):
        raise ParameterError(
            f"side={side} is too many for this surface: {flat:,} new triangles have no area. Take "
            "as many as its boundary has room for, e.g. "
            f"side={max(4, min(side - 1, len(mesh.loops[0]) // 3))}."
        )
    return DiskMesh.from_arrays(V, F, name=mesh.name), points


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


def _check_side(side: int) -> None:
    """Raise :class:`ParameterError` for a side out of range."""
    if not LEAST <= side <= MOST:
        raise ParameterError(f"the side is {side}; allowed: {LEAST} to {MOST} samples.")


def _check_disk(mesh: TriangleMesh, z: Complex) -> None:
    """Raise :class:`ParameterError` for a map that is not onto the disk."""
    if len(mesh.loops) == 1:
        off = float(np.abs(np.abs(z[mesh.loops[0]]) - 1).max())
        if off <= _ON_CIRCLE:
            return
        why = f"its boundary lies off the unit circle by up to {off:.2g}"
    else:
        why = f"the surface has {len(mesh.loops)} boundaries"
    raise ParameterError(
        f'the map of {mesh.name} does not cover the disk: {why}. Take target="disk" on a '
        "surface with one boundary."
    )
