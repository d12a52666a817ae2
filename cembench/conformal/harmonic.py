"""Harmonic maps with a prescribed boundary (Eq. 10)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.laplacian import by_rows
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh


def edge_lengths(mesh: TriangleMesh, loop: NDArray[np.int64]) -> NDArray[np.float64]:
    """How long is the edge from each vertex of a boundary loop to the next? Shape (k,)."""
    corners = mesh.V[loop]
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def arc_length_circle(mesh: DiskMesh) -> NDArray[np.complex128]:
    """Where on the unit circle does each boundary vertex go, in proportion to edge length?

    Shape (k,), in the order of ``mesh.boundary``, counter-clockwise, the first vertex at 1.
    """
    lengths = edge_lengths(mesh, mesh.boundary)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.exp(2j * np.pi * travelled[:-1] / travelled[-1])


def harmonic_extension(
    L: sparse.csc_array, fixed: NDArray[np.int64], values: NDArray[Any]
) -> NDArray[Any]:
    """Which map is harmonic for L and takes these values at the fixed vertices (Eq. 10)?

    L (n, n) positive semi-definite, `fixed` (k,) indices, `values` (k,), real or complex; the
    result is (n,), of the same type.
    """
    n = L.shape[0]
    f = np.zeros(n, dtype=values.dtype)
    f[fixed] = values
    free = np.ones(n, dtype=bool)
    free[fixed] = False
    i = np.flatnonzero(free)
    if len(i):
        with phase("assembly"):
            rows = by_rows(L)[i]
            L_ii, right = rows[:, i], -(rows[:, fixed] @ f[fixed])
        f[i] = Cholesky(L_ii).solve(right)
    return f
