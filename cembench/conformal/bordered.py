"""A Laplacian ordered so that one factorisation serves the boundary and the interior."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.laplacian import by_rows
from cembench.conformal.planar import polygon_area
from cembench.conformal.ring_order import ring_pays
from cembench.core.arrays import Complex, Indices, Real, marked
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.cholesky import LARGEST_DENSE, Cholesky, shows_trailing_block
from cembench.linear_algebra.lower_triangle import permuted_lower
from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.triangular import triangle_solved
from cembench.mesh.triangle_mesh import TriangleMesh

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
        Its boundary loops, in the order wanted.
    iterations : int
        How many times at most the harmonic map is needed beside the boundary only, as in CEM.
        :meth:`dirichlet` then gives the values at the neighbours of the boundary alone. Where that
        pays (:func:`cembench.conformal.ring_order.ring_pays`) these are put last in the interior;
        else substitutions pass the columns that lead to them.

    Attributes
    ----------
    interior, boundary : int64
        Indices i, and b: the loops one behind the other.
    beside : int64
        The interior vertices at which :meth:`dirichlet` gives values: the neighbours of the
        boundary if there are iterations and the library shows its factors, else all.
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
        self,
        mesh: TriangleMesh,
        L: scipy.sparse.sparray,
        loops: Sequence[Indices],
        *,
        iterations: int = 0,
    ) -> None:
        self.interior, self.boundary = mesh.interior, np.concatenate(loops)
        ends = [0, *accumulate(map(len, loops))]
        self.parts = tuple(slice(*between) for between in pairwise(ends))
        if not len(self.interior):
            raise AlgorithmFailed(
                "the mesh has no interior vertex, so a harmonic map has no unknowns"
            )
        with phase("assembly"):
            self.beside, self._ringed = self._ring(L, iterations)
            if self._ringed:
                rest = np.setdiff1d(self.interior, self.beside, assume_unique=True)
                self.interior = np.concatenate([rest, self.beside])
            self._order = np.concatenate([self.interior, self.boundary])
            self._boundary_rows = by_rows(L)[self.boundary]
            pinned = permuted_lower(by_rows(L), self._order[:-1])
        leading = len(self.interior) - (len(self.beside) if self._ringed else 0)
        self._whole = Cholesky(pinned, leading=leading, lower=True)

    def _ring(self, L: scipy.sparse.sparray, iterations: int) -> tuple[Indices, bool]:
        """Which interior vertices get values, and whether these come last in the interior."""
        too_long = len(self.boundary) > LARGEST_DENSE
        if not iterations or too_long or not shows_trailing_block():
            return self.interior, False
        near = marked(L.shape[0], by_rows(L)[self.boundary].indices)
        near[self.boundary] = False
        ring = np.flatnonzero(near)
        sizes = len(self.interior), len(ring), len(self.boundary)
        short = len(ring) + len(self.boundary) <= LARGEST_DENSE
        return ring, short and ring_pays(*sizes, iterations)

    @cached_property
    def _rows_beside(self) -> Indices | None:
        """Positions of `beside` in the interior; None if it is all of it."""
        if len(self.beside) == len(self.interior):
            return None
        return np.searchsorted(self.interior, self.beside)

    @cached_property
    def L_bi(self) -> scipy.sparse.csr_array:
        """The boundary's rows of L, the columns of `beside`: all others are zero."""
        with phase("assembly"):
            return self._boundary_rows[:, self.beside].sorted_indices()

    @cached_property
    def _L_ib(self) -> scipy.sparse.csr_array:
        with phase("assembly"):
            return scipy.sparse.csr_array(self.L_bi.T)

    @cached_property
    def L_bb(self) -> scipy.sparse.csc_array:
        """The boundary's rows and columns of L."""
        with phase("assembly"):
            return scipy.sparse.csc_array(self._boundary_rows[:, self.boundary])

    def in_order(self, f_i: NDArray[T], f_b: NDArray[T]) -> NDArray[T]:
        """Return values on the interior and the boundary as one array (n,) in mesh order."""
        f = np.empty(len(self._order), dtype=f_b.dtype)
        f[self._order] = np.concatenate([f_i, f_b])
        return f

    def solved_boundary(self, rhs: Complex) -> Complex:
        """The boundary values of L f = rhs (n,), 0 in sum, with f = 0 at the last of them."""
        solved = self._whole.solve_trailing(rhs[self._order][:-1])
        return np.append(solved, 0.0)[-len(self.boundary) :]

    def solve_interior(self, rhs_i: NDArray[Any]) -> NDArray[Any]:
        """Return f_i with L_ii f_i = rhs_i; not in the ring's order."""
        self._needs_all_inside("solve_interior")
        return self._whole.solve_leading(rhs_i)

    def dirichlet(self, f_b: Complex) -> Complex:
        """The interior values with L_ii f_i = -L_ib f_b (Eq. 22), of the vertices `beside`.

        By half a solve where the factor shows its trailing block.
        """
        if self._ringed:
            with phase("solves"):
                return by_real_columns(self._ring_values, (f_b - f_b[-1])[:-1]) + f_b[-1]
        if self._whole.halves or self._rows_beside is not None:
            return self._extended(f_b, self._rows_beside)
        return self.solve_interior(-(self._L_ib @ f_b))

    def _extended(self, f: Complex, rows: Indices | None = None) -> Complex:
        """Return the harmonic values before f, which holds those of the last vertices in order.

        All of them, or those in some rows.
        """
        # Constants are harmonic: so the last vertex can be taken to 0 and back.
        return self._whole.extended((f - f[-1])[:-1], rows) + f[-1]

    def _needs_all_inside(self, what: str) -> None:
        """Refuse what would take the other interior for all of it."""
        if self._ringed:
            raise ValueError(
                f"{what} needs the whole interior before the boundary, but here the boundary's "
                "neighbours come in between; construct BorderedLaplacian with iterations=0"
            )

    @cached_property
    def _ring_triangles(self) -> tuple[Real, Real]:
        """The dense factor's rows of the ring, and of the boundary below it."""
        k, C = len(self.beside), self._whole.schur_factor()
        return np.asfortranarray(C[:k, :k]), C[k:, :k]

    def _ring_values(self, X: Real) -> Real:
        """Return the values on the ring for boundary values X (B - 1, k), 0 at the last vertex."""
        own, below = self._ring_triangles
        return triangle_solved(own, -(below.T @ X), transposed=True)

    def completed(self, f_i: Complex, f_b: Complex) -> Complex:
        """The map (n,) of boundary values and what :meth:`dirichlet` gave for them."""
        if self._ringed:
            f_i = np.concatenate([self._extended(np.concatenate([f_i, f_b])), f_i])
        elif len(f_i) < len(self.interior):
            f_i = self._extended(f_b)
        return self.in_order(f_i, f_b)

    def conformal_energy(self, f_i: Complex, f_b: Complex) -> float:
        """E_C (Eq. 7) of a map that is harmonic inside: only the boundary's rows count.

        `f_i` at the vertices `beside`.
        """
        with phase("energy"):
            dirichlet = 0.5 * float(np.vdot(f_b, self.L_bb @ f_b + self.L_bi @ f_i).real)
            return dirichlet - polygon_area(f_b)

    def dirichlet_to_neumann(self) -> DirichletToNeumann:
        """Return S = L_bb - L_bi L_ii^-1 L_ib, as its triangular factor or, if large, by solves.

        Not in the ring's order.
        """
        self._needs_all_inside("dirichlet_to_neumann")
        if len(self.boundary) > LARGEST_DENSE:
            return DirichletToNeumann(self._whole.schur_times, self._whole.schur_solved)
        return DirichletToNeumann.of_factor(self._whole.schur_factor())

    @cached_property
    def S(self) -> Real:
        """S as a dense matrix (B, B): positive semi-definite, rows sum to zero.

        Not in the ring's order.
        """
        self._needs_all_inside("S")
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
        whose columns also sum to 1. Not in the ring's order.
        """
        self._needs_all_inside("swept_to_boundary")
        weights = self._whole.condensed(measure[self._order][:-1])
        return np.concatenate([weights, 1 - weights.sum(axis=0, keepdims=True)])

    def harmonic_extension(self, f_b: Complex) -> Complex:
        """Return the harmonic map (n,) with these boundary values, by half a solve.

        Not in the ring's order, where :meth:`completed` gives it.
        """
        self._needs_all_inside("harmonic_extension")
        return self.in_order(self._extended(f_b), f_b)
