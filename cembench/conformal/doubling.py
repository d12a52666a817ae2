"""A surface glued to its mirror copy along the boundary; from a disk, a sphere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh


@dataclass(frozen=True)
class DoubledSurface:
    """The triangles of both copies; vertices 0 to n - 1 are those of the surface itself.

    Parameters
    ----------
    F : int64 (2 m, 3)
        The surface's triangles, then their mirror images in the same order, reversed so that the
        whole surface is oriented.
    mirror : int64 (n,)
        The copy of each vertex of the surface; a boundary vertex is its own copy.
    size : int
        Number of vertices of both copies together.
    """

    F: Indices
    mirror: Indices
    size: int

    @property
    def half(self) -> Indices:
        """The surface's own vertex of each vertex of the double, int64 (size,)."""
        return self.on_both(np.arange(len(self.mirror)))

    def on_both(self, values: NDArray[Any]) -> NDArray[Any]:
        """Extend values at the surface's vertices (n, ...) to both copies (size, ...)."""
        both = np.empty((self.size, *values.shape[1:]), dtype=values.dtype)
        both[self.mirror] = values
        both[: len(values)] = values
        return both


def doubled(mesh: DiskMesh) -> DoubledSurface:
    """Return a surface glued to its mirror copy.

    A chord, an interior edge between two boundary vertices, is shared by both copies and then has
    four triangles; sums over triangles are still correct.
    """
    mirror = np.arange(mesh.n)
    mirror[mesh.interior] = mesh.n + np.arange(len(mesh.interior))
    return DoubledSurface(
        np.concatenate([mesh.F, mirror[mesh.F][:, ::-1]]), mirror, mesh.n + len(mesh.interior)
    )


def doubled_surface(
    mesh: DiskMesh, *, delaunay: bool = False
) -> tuple[scipy.sparse.csc_array, DoubledSurface, scipy.sparse.csc_array, Real]:
    """Return a surface's Laplacian, its double, and the double's Laplacian and vertices.

    Raises
    ------
    AlgorithmFailed
        The mesh has no interior vertex.
    """
    if not len(mesh.interior):
        raise AlgorithmFailed("the mesh has no interior vertex, so both its copies coincide")
    L = laplacian(mesh, delaunay=delaunay)
    double = doubled(mesh)
    with phase("assembly"):
        return L, double, doubled_laplacian(L, double), double.on_both(mesh.V)


def doubled_laplacian(L: scipy.sparse.csc_array, double: DoubledSurface) -> scipy.sparse.csc_array:
    """Return the Laplacian of the doubled surface: the sum of L (n, n) over both copies."""
    one = scipy.sparse.coo_array(L)
    i = np.concatenate([one.row, double.mirror[one.row]])
    j = np.concatenate([one.col, double.mirror[one.col]])
    both = scipy.sparse.coo_array((np.tile(one.data, 2), (i, j)), shape=(double.size, double.size))
    return scipy.sparse.csc_array(both)
