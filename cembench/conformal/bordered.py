"""A Laplacian ordered so that one factorisation serves the boundary and the interior."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.laplacian import by_rows
from cembench.conformal.planar import polygon_area
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.cholesky import LARGEST_DENSE, Cholesky
from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
T = TypeVar("T", bound=np.generic)


class BorderedLaplacian:
    """L with the interior first, then the boundary loops as given, the last vertex pinned.

    Its Cholesky factor contains that of L_ii as its leading block, and that of the boundary's Schur
    complement, which is the Dirichlet-to-Neumann matrix, as its trailing block. Anything glued to
    the boundary, such as patches that fill holes, changes only that small block.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    L : sparse (n, n)
        Its Laplacian.
    loops : sequence of int arrays
        Its boundary loops, in the wanted order.

    Attributes
    ----------
    interior, boundary : int64
        Indices i and b; b is the concatenation of the loops.
    parts : tuple of slice
        The position of each loop in the boundary.

    Raises
    ------
    AlgorithmFailed
        The mesh has no interior vertex.
    NotPositiveDefinite
        L with its last vertex pinned is not positive definite.

    """

    def __init__(
        self, mesh: TriangleMesh, L: sparse.sparray, loops: Sequence[NDArray[np.int64]]
    ) -> None:
        self.interior, self.boundary = mesh.interior, np.concatenate(loops)
        ends = [0, *accumulate(map(len, loops))]
        self.parts = tuple(slice(*between) for between in pairwise(ends))
        if not len(self.interior):
            raise AlgorithmFailed(
                "the mesh has no interior vertex, so no harmonic map has any freedom"
            )
        with phase("assembly"):
            order = self._order = np.concatenate([self.interior, self.boundary])
            self._ordered = sparse.csc_array(by_rows(L)[order][:, order].T)  # symmetric again
            pinned = self._ordered[:-1, :-1]
        self._whole = Cholesky(pinned, leading=len(self.interior))

    @cached_property
    def L_bi(self) -> sparse.csr_array:
        """The rows of L of the boundary and its columns of the interior."""
        n_i = len(self.interior)
        with phase("assembly"):
            return sparse.csr_array(self._ordered)[n_i:, :n_i]

    @cached_property
    def _L_ib(self) -> sparse.csr_array:
        with phase("assembly"):
            return sparse.csr_array(self.L_bi.T)

    @cached_property
    def L_bb(self) -> sparse.csc_array:
        """The rows and columns of L of the boundary."""
        n_i = len(self.interior)
        with phase("assembly"):
            return self._ordered[n_i:, n_i:]

    def in_order(self, f_i: NDArray[T], f_b: NDArray[T]) -> NDArray[T]:
        """Return values on the interior and the boundary as one array (n,) in mesh order."""
        f = np.empty(len(self._order), dtype=f_b.dtype)
        f[self._order] = np.concatenate([f_i, f_b])
        return f

    def solved_boundary(self, rhs: Complex) -> Complex:
        """Return the boundary values of L f = rhs (n,), sum(rhs) = 0, that end in 0."""
        f = np.append(self._whole.solve(rhs[self._order][:-1]), 0.0)
        return f[len(self.interior) :]

    def solve_interior(self, rhs_i: NDArray[Any]) -> NDArray[Any]:
        """Return f_i with L_ii f_i = rhs_i."""
        return self._whole.solve_leading(rhs_i)

    def dirichlet(self, f_b: Complex) -> Complex:
        """Return the interior values f_i with L_ii f_i = -L_ib f_b (Eq. 22)."""
        return self.solve_interior(-(self._L_ib @ f_b))

    def conformal_energy(self, f_i: Complex, f_b: Complex) -> float:
        """Return E_C (Eq. 7) of a map that is harmonic inside, from the boundary rows alone."""
        with phase("energy"):
            dirichlet = 0.5 * float(np.vdot(f_b, self.L_bb @ f_b + self.L_bi @ f_i).real)
            return dirichlet - polygon_area(f_b)

    def dirichlet_to_neumann(self) -> DirichletToNeumann:
        """Return S = L_bb - L_bi L_ii^-1 L_ib, as its triangular factor or, if large, by solves."""
        if len(self.boundary) > LARGEST_DENSE:
            return DirichletToNeumann(self._whole.schur_times, self._whole.schur_solved)
        return DirichletToNeumann.of_factor(self._whole.schur_factor())

    @cached_property
    def S(self) -> Real:
        """S as a dense matrix (B, B): positive semi-definite, rows sum to zero."""
        C = self._whole.schur_factor()
        with phase("condensation"):
            pinned = C @ C.T
            # The last row and column follow from the zero sums (Theorem 1).
            S = np.zeros((len(C) + 1, len(C) + 1))
            S[:-1, :-1] = pinned
            S[-1, :-1] = S[:-1, -1] = -pinned.sum(axis=0)
            S[-1, -1] = pinned.sum()
            return S

    def swept_to_boundary(self, measure: Real) -> Real:
        """Return boundary weights that give every harmonic function the same mean as `measure`.

        `measure` is (n, k) with columns that sum to 1. The result (B, k) is its harmonic measure,
        whose columns also sum to 1.
        """
        weights = self._whole.condensed(measure[self._order][:-1])
        return np.concatenate([weights, 1 - weights.sum(axis=0, keepdims=True)])

    def harmonic_extension(self, f_b: Complex) -> Complex:
        """Return the harmonic map (n,) with these boundary values, by half a solve."""
        # Constants are harmonic, so the last vertex can be shifted to 0 and back.
        f_i: Any = self._whole.extended((f_b - f_b[-1])[:-1]) + f_b[-1]
        return self.in_order(f_i, f_b)
