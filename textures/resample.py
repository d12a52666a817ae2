"""Resample a surface through its map: geometry images, and meshes with equilateral triangles.

Both locate points of the plane on the surface. A conformal map preserves small shapes, so squares
and equilateral triangles of the plane are nearly squares and equilateral on the surface; their
sizes follow the scaling of the map.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

import numpy as np
from scipy.spatial import Delaunay

from cembench.conformal.resample import interpolated, locate, square_to_disk
from cembench.core.arguments import Range, checked
from cembench.core.arrays import Complex, Real
from cembench.core.errors import ParameterError
from cembench.mesh.defects import degenerate
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Grid: TypeAlias = Literal["square", "disk"]
#: Samples along a side.
Side: TypeAlias = Annotated[int, Range(4, 8192)]

#: Allowed distance of a disk map's boundary from the unit circle.
ON_CIRCLE = 1e-9


@checked
def geometry_image(mesh: TriangleMesh, z: Complex, side: Side, grid: Grid = "square") -> Real:
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


@checked
def regular_remesh(mesh: TriangleMesh, z: Complex, side: Side) -> tuple[DiskMesh, Complex]:
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


def off_the_circle(mesh: TriangleMesh, z: Complex) -> float:
    """Return how far a boundary lies off the unit circle; infinite for several boundaries."""
    return float(np.abs(np.abs(z[mesh.loops[0]]) - 1).max()) if len(mesh.loops) == 1 else np.inf


def _check_disk(mesh: TriangleMesh, z: Complex) -> None:
    """Raise :class:`ParameterError` for a map that is not onto the disk."""
    if (off := off_the_circle(mesh, z)) <= ON_CIRCLE:
        return
    why = f"its boundary lies off the unit circle by up to {off:.2g}"
    if len(mesh.loops) > 1:
        why = f"the surface has {len(mesh.loops)} boundaries"
    raise ParameterError(
        f'the map of {mesh.name} does not cover the disk: {why}. Take target="disk" on a '
        "surface with one boundary."
    )
