"""Sparse factorisation by SciPy's SuperLU in symmetric mode: the fallback that always works."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from cembench.clock import phase
from cembench.errors import NotPositiveDefinite


class SuperLUFactor:
    """The interface of :class:`~cembench.geometry.cholmod.CholmodFactor`.

    SuperLU solves only with its whole factor: the leading block is factored too, when first used.
    """

    def __init__(self, A: sparse.csc_array, leading: int | None) -> None:
        self._leading = leading
        self.update(A)

    def update(self, A: sparse.csc_array) -> None:
        """Factor another matrix; SuperLU keeps nothing of the analysis."""
        self._A = A
        self.__dict__.pop("_leading_factor", None)
        self._factor = _factor(A)

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        """A x = B for real columns B (n, k)."""
        return np.asarray(self._factor.solve(B))

    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        """A_ii x = B for the leading block; B (leading, k)."""
        return np.asarray(self._leading_factor.solve(B))

    @cached_property
    def _leading_factor(self) -> SuperLU:
        k = self._leading
        return _factor(sparse.csc_array(self._A[:k, :k]))


def _factor(A: sparse.csc_array) -> SuperLU:
    with phase("factorisation"):
        try:
            factor = splu(
                A,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise NotPositiveDefinite(f"the matrix is singular ({error})") from None
        # With the diagonal as pivots, these are the D of L D L^T: all positive or not definite.
        if not (factor.U.diagonal() > 0).all():
            raise NotPositiveDefinite(
                f"the matrix of order {A.shape[0]} is not positive definite "
                f"(smallest pivot {factor.U.diagonal().min():.3g})"
            )
        return factor
