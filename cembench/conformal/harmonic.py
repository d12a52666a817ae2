"""Harmonic maps with a prescribed boundary (Eq. 10)."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.laplacian import by_rows
from cembench.core.arrays import Complex, Indices, Real, marked
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh


def edge_lengths(mesh: TriangleMesh, loop: Indices) -> Real:
    """Return the edge length from each vertex of a boundary loop to the next, (k,)."""
    corners = mesh.V[loop]
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def arc_length_circle(mesh: DiskMesh) -> Complex:
    """Return boundary positions on the unit circle, spaced in proportion to edge length.

    Parameters
    ----------
    mesh : DiskMesh
        The surface, with k boundary vertices.

    Returns
    -------
    complex128 (k,)
        In the order of ``mesh.boundary``, counter-clockwise, the first vertex at 1.

    Examples
    --------
    >>> import cembench, numpy as np
    >>> circle = arc_length_circle(cembench.surface("flat-disk", 600))
    >>> bool(np.allclose(abs(circle), 1))
    True
    """
    lengths = edge_lengths(mesh, mesh.boundary)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.exp(2j * np.pi * travelled[:-1] / travelled[-1])


def harmonic_extension(
    L: scipy.sparse.csc_array, fixed: Indices, values: NDArray[Any]
) -> NDArray[Any]:
    """Return the map that is harmonic for L and has these values at the fixed vertices (Eq. 10).

    Parameters
    ----------
    L : sparse (n, n)
        Positive semi-definite Laplacian.
    fixed : int64 (k,)
        Fixed vertices.
    values : float or complex (k,)
        Their images.

    Returns
    -------
    float or complex (n,)
        The image of each vertex, of the type of `values`.

    Raises
    ------
    NotPositiveDefinite
        The interior block of L is not positive definite.

    References
    ----------
    Eq. (10) of the CEM paper.

    Examples
    --------
    >>> import cembench
    >>> from cembench.conformal.laplacian import laplacian
    >>> disk = cembench.surface("flat-disk", 600)
    >>> z = harmonic_extension(laplacian(disk), disk.boundary, arc_length_circle(disk))
    >>> z.shape == (disk.n,)
    True
    """
    return HarmonicExtension(L, fixed)(values)


class HarmonicExtension:
    """Harmonic maps for L whose values at the same vertices are given, time and again (Eq. 10).

    Under "reuse" the first one factors the rest's block of L, and the factor is kept. Arguments and
    errors as for :func:`harmonic_extension`.
    """

    def __init__(self, L: scipy.sparse.csc_array, fixed: Indices) -> None:
        self._L, self._fixed = L, fixed
        free = ~marked(L.shape[0], fixed)
        self._free = np.flatnonzero(free)

    @cached_property
    def _blocks(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """Rows of L for the free vertices: the columns of free vertices, and of fixed ones."""
        with phase("assembly"):
            rows = by_rows(self._L)[self._free]
            return rows[:, self._free], rows[:, self._fixed]

    @cached_property
    def _factor(self) -> Cholesky:
        return Cholesky(self._blocks[0])

    def __call__(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the harmonic map with these values at the fixed vertices."""
        f = np.zeros(self._L.shape[0], dtype=values.dtype)
        f[self._fixed] = values
        if len(self._free):
            to_fixed = self._blocks[1]
            with phase("assembly"):
                right = -(to_fixed @ f[self._fixed])
            f[self._free] = self._factor.solve(right)
        return f
