"""Sparse Cholesky by cvxopt's CHOLMOD, the default: the fastest that installs as a wheel."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from cvxopt import cholmod, matrix, spmatrix
from numpy.typing import NDArray
from scipy import sparse

from cembench.core.arrays import Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.factor_part import FactorPart, FactorTree
from cembench.linear_algebra.orderings import as_permutation, minimum_degree, set_options
from cembench.linear_algebra.supernodes import factor_entries, trailing_block
from cembench.linear_algebra.triangular import triangle_solved, triangle_times
from cembench.linear_algebra.work import count_analysis, count_columns, count_factorisation

# Codes of `cholmod.solve`: the whole system, and its four steps.
_ALL, _FORWARD, _BACKWARD, _PERMUTE, _PERMUTE_BACK = 0, 4, 5, 7, 8


#: Up to this share of rows with entries, substitution passes their ancestors instead of all.
FEW = 0.1
#: From a lower triangle to the order of its rows, by the postorder of the elimination tree:
#: otherwise columns of one supernode would not be neighbours.
Order = Callable[[spmatrix], Indices]


class CholmodFactor:
    """A factor of a symmetric positive definite matrix A; only its lower triangle is read.

    `leading` is the order of the block to keep first. Its factor is then the leading block of this
    factor, which :meth:`solve_leading` uses. `order` orders rows and columns.
    """

    def __init__(
        self, A: sparse.csc_array, leading: int | None, *, order: Order = minimum_degree
    ) -> None:
        self._leading = leading
        with phase("ordering"):
            self._lower, self._below = _lower_triangle(A)
            permutation = _order(self._lower, leading, order)
            self._permutation = as_permutation(permutation)
            self.order: Indices | None = permutation
        self._analyse()
        self._factor()

    def _analyse(self) -> None:
        with phase("symbolic"):
            set_options(postorder=self._leading is None)
            self._symbolic = cholmod.symbolic(self._lower, self._permutation)
            vars(self).pop("_tree", None)
            self._near: tuple[Indices, FactorPart | None] | None = None
            count_analysis()

    def _factor(self) -> None:
        self._trailing: Real | None = None
        with phase("factorisation"):
            set_options(postorder=self._leading is None)
            try:
                cholmod.numeric(self._lower, self._symbolic)
            except ArithmeticError as error:
                raise NotPositiveDefinite(
                    f"the matrix of order {self._lower.size[0]} is not positive definite "
                    f"(Cholesky pivot {error})"
                ) from None
            count_factorisation(self._lower.size[0], lambda: factor_entries(self._symbolic))

    def update(self, A: sparse.csc_array) -> None:
        """Factor another matrix of the same pattern; ordering and symbolic analysis are kept."""
        with phase("factorisation"):
            self._lower.V = matrix(_in_order(A).data[self._below])
        if self._leading is not None:
            # Partial solves are wrong with a factor that overwrote an older one.
            self._analyse()
        self._factor()

    def solve(self, B: Real) -> Real:
        """Return X with A X = B for real columns B (n, k)."""
        x = matrix(np.asfortranarray(B))
        cholmod.solve(self._symbolic, x, sys=_ALL)
        return np.array(x)

    def part(self, rows: Indices) -> FactorPart | None:
        """Return what substitutions between these rows pass; None if inaccessible."""
        return None if self._tree is None else FactorPart(self._tree, rows)

    @cached_property
    def _tree(self) -> FactorTree | None:
        return FactorTree.of(self._symbolic, self._lower.size[0])

    def solve_leading(self, B: Real) -> Real:
        """Return X with A_ii X = B for the leading block, from the one factor; B (leading, k)."""
        assert self._leading is not None
        padded = np.zeros((self._lower.size[0], B.shape[1]), order="F")
        padded[: self._leading] = B
        x = matrix(padded)
        cholmod.solve(self._symbolic, x, sys=_PERMUTE)
        cholmod.solve(self._symbolic, x, sys=_FORWARD)
        x[self._leading :, :] = 0.0
        cholmod.solve(self._symbolic, x, sys=_BACKWARD)
        cholmod.solve(self._symbolic, x, sys=_PERMUTE_BACK)
        return np.array(x)[: self._leading]

    def schur_factor(self) -> Real | None:
        """Return the trailing block of the factor, after the leading one; None if inaccessible."""
        assert self._leading is not None
        if self._trailing is None:
            self._trailing = trailing_block(self._symbolic, self._lower.size[0], self._leading)
        return self._trailing

    def solve_trailing(self, B: Real) -> Real | None:
        """x_t of A x = B for B (n, k): L y = B ends in y_t with C^T x_t = y_t."""
        C = self.schur_factor()
        return None if C is None else triangle_solved(C, self._forward_end(B), transposed=True)

    def condensed(self, B: Real) -> Real | None:
        """Return B_t - A_tl A_ll^-1 B_l for B (n, k): C y_t, where L y = B ends in y_t."""
        C = self.schur_factor()
        return None if C is None else triangle_times(C, self._forward_end(B))

    def _forward_end(self, B: Real) -> Real:
        """y_t of L y = B; of the leading rows only those of few entries and their ancestors."""
        assert self._leading is not None
        rows = np.flatnonzero(B[: self._leading].any(axis=1))
        if len(rows) <= FEW * self._leading and (part := self._with_trailing(rows)) is not None:
            count_columns(part.share / 2 * B.shape[1])
            ends = np.concatenate([B[rows], B[self._leading :]])
            return part.forward(ends)[part.at[len(rows) :]]
        count_columns(B.shape[1] / 2)
        x = matrix(np.asfortranarray(B))
        cholmod.solve(self._symbolic, x, sys=_PERMUTE)
        cholmod.solve(self._symbolic, x, sys=_FORWARD)
        return np.array(x)[self._leading :]

    def _with_trailing(self, rows: Indices) -> FactorPart | None:
        """Return the part between rows of the leading block and all behind it."""
        assert self._leading is not None
        trailing = np.arange(self._leading, self._lower.size[0])
        return self.part(np.concatenate([rows, trailing]))

    def extended(self, B: Real, rows: Indices | None = None) -> Real | None:
        """Return -A_ll^-1 A_lt B for B (n - leading, k): the solution of L^T x = (0, C^T B).

        All leading rows of it, or some.
        """
        C = self.schur_factor()
        if C is None:
            return None
        right = triangle_times(C, B, transposed=True)
        if rows is not None and (part := self._kept_part(rows)) is not None:
            count_columns(part.share / 2 * B.shape[1])
            ends = np.zeros((len(part.columns), B.shape[1]), order="F")
            ends[part.at[len(rows) :]] = right
            return part.backward(ends)[part.at[: len(rows)]]
        count_columns(B.shape[1] / 2)
        padded = np.zeros((self._lower.size[0], B.shape[1]), order="F")
        padded[self._leading :] = right
        x = matrix(padded)
        cholmod.solve(self._symbolic, x, sys=_BACKWARD)
        cholmod.solve(self._symbolic, x, sys=_PERMUTE_BACK)
        return np.array(x)[slice(self._leading) if rows is None else rows]

    def _kept_part(self, rows: Indices) -> FactorPart | None:
        """Return the part from some rows on, made once for the same array."""
        if self._near is None or self._near[0] is not rows:
            self._near = rows, self._with_trailing(rows)
        return self._near[1]


def _lower_triangle(A: sparse.csc_array) -> tuple[spmatrix, NDArray[np.intp]]:
    """Return the lower triangle of A, and which entries of A it has."""
    A = _in_order(A)
    columns = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
    below = np.flatnonzero(A.indices >= columns)
    if len(below) < A.nnz:
        data, rows, columns = A.data[below], A.indices[below], columns[below]
    else:
        data, rows = A.data, A.indices
    return spmatrix(data, rows.astype(np.int64), columns, A.shape, "d"), below


def _in_order(A: sparse.csc_array) -> sparse.csc_array:
    """Return A with the entries of each column sorted by row, as cvxopt requires."""
    return A if A.has_sorted_indices else A.sorted_indices()


def _order(lower: spmatrix, leading: int | None, order: Order) -> Indices:
    """Return the order of all rows, or that of the leading block with the others after it."""
    if leading is None:
        return order(lower)
    first = order(lower[:leading, :leading]) if leading else np.zeros(0, dtype=np.int64)
    return np.concatenate([first, np.arange(leading, lower.size[0])])
