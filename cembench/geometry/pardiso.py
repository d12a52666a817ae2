"""Sparse Cholesky by MKL Pardiso; needs the extra ``cembench[pardiso]``."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pypardiso
from numpy.typing import NDArray
from pypardiso.pardiso_wrapper import PyPardisoError
from scipy import sparse

from cembench.clock import phase
from cembench.errors import NotPositiveDefinite

#: Pardiso's matrix type for real symmetric positive definite.
_SPD = 2


class PardisoFactor:
    """The interface of :class:`~cembench.geometry.cholmod.CholmodFactor`.

    Pardiso solves only with its whole factor: the leading block is factored too, when first used.
    """

    def __init__(self, A: sparse.csc_array, leading: int | None) -> None:
        self._leading = leading
        self.update(A)

    def update(self, A: sparse.csc_array) -> None:
        """Factor another matrix."""
        self._A = A
        self.__dict__.pop("_leading_factor", None)
        self._factor = _Factor(A)

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        """A x = B for real columns B (n, k)."""
        return self._factor.solve(B)

    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        """A_ii x = B for the leading block; B (leading, k)."""
        return self._leading_factor.solve(B)

    @cached_property
    def _leading_factor(self) -> _Factor:
        k = self._leading
        return _Factor(sparse.csc_array(self._A[:k, :k]))


class _Factor:
    def __init__(self, A: sparse.csc_array) -> None:
        with phase("factorisation"):
            # Pardiso reads the upper triangle by rows and wants every diagonal entry stored.
            self._upper = sparse.csr_matrix(sparse.triu(A, format="csr"))
            self._solver = pypardiso.PyPardisoSolver(mtype=_SPD)
            try:
                self._solver.factorize(self._upper)
            except PyPardisoError as error:
                raise NotPositiveDefinite(
                    f"the matrix of order {A.shape[0]} is not positive definite ({error})"
                ) from None

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._solver.solve(self._upper, np.asfortranarray(B)))

    def __del__(self) -> None:
        self._solver.free_memory(everything=True)
