"""A surface's Laplacian ordered for one factorisation that serves boundary and interior."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.clock import phase
from cembench.errors import AlgorithmFailed
from cembench.geometry.cholesky import Cholesky
from cembench.geometry.dirichlet_to_neumann import DirichletToNeumann
from cembench.geometry.mesh import TriangleMesh

Complex = NDArray[np.complex128]


class BorderedLaplacian:
    """L with the interior first, then the boundary loops as they are named, the last vertex pinned.

    Its Cholesky factor holds that of L_ii as its leading block, and that of the boundary's Schur
    complement, which is the Dirichlet-to-Neumann matrix, as its trailing one.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    L : sparse (n, n)
        Its Laplacian.
    loops : sequence of int arrays
        Its boundary loops, in the order wanted.

    Raises
    ------
    AlgorithmFailed
        The mesh has no interior vertex.

    """

    def __init__(
        self, mesh: TriangleMesh, L: sparse.csc_array, loops: tuple[NDArray[np.int64], ...]
    ) -> None:
        self._n_i = len(mesh.interior)
        if self._n_i == 0:
            raise AlgorithmFailed(
                "the mesh has no interior vertex, so no harmonic map has any freedom"
            )
        with phase("assembly"):
            self._order = np.concatenate([mesh.interior, *loops])
            ordered = sparse.csc_array(sparse.csr_array(L)[self._order][:, self._order])
            pinned = ordered[:-1, :-1]
        self._whole = Cholesky(pinned, leading=self._n_i)

    def dirichlet_to_neumann(self) -> DirichletToNeumann:
        """S = L_bb - L_bi L_ii^-1 L_ib."""
        return DirichletToNeumann(self._whole.schur_factor())

    def swept_to_boundary(self, measure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Which weights on the boundary give every harmonic map the mean that the measure gives?

        `measure` is (n, k), each column 1 in sum; the result (B, k) is its harmonic measure, 1 in
        sum too.
        """
        weights = self._whole.condensed(measure[self._order][:-1])
        return np.concatenate([weights, 1 - weights.sum(axis=0, keepdims=True)])

    def harmonic_extension(self, f_b: Complex) -> Complex:
        """The map with these boundary values and L_ii f_i = -L_ib f_b (Eq. 22); (n,)."""
        f = np.empty(len(self._order), dtype=np.complex128)
        # Constants are harmonic: so the last vertex can be taken to 0 and back.
        f_i: Any = self._whole.extended((f_b - f_b[-1])[:-1]) + f_b[-1]
        f[self._order] = np.concatenate([f_i, f_b])
        return f
