"""Cholesky factors of the small dense matrices that remain after eliminating an interior."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.triangular import triangle_solved
from cembench.linear_algebra.work import count_dense


class DenseCholesky:
    """Solve systems with a small dense Hermitian positive definite matrix, real or complex.

    Raises
    ------
    NotPositiveDefinite
        The matrix is not positive definite.
    """

    def __init__(self, A: NDArray[Any]) -> None:
        with phase("dense factorisation"):
            try:
                self._C, _ = scipy.linalg.cho_factor(A, lower=True, check_finite=False)
            except scipy.linalg.LinAlgError as error:
                raise NotPositiveDefinite(
                    f"the dense matrix of order {len(A)} is not positive definite ({error})"
                ) from None

            count_dense(len(A))

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """Return x with A x = b, real or complex."""
        with phase("solves"):
            if np.iscomplexobj(self._C):
                return np.asarray(scipy.linalg.cho_solve((self._C, True), b, check_finite=False))
            return by_real_columns(self._solve, b)

    def _solve(self, B: Real) -> Real:
        return triangle_solved(self._C, triangle_solved(self._C, B), transposed=True)
