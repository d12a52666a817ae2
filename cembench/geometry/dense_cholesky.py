"""Cholesky factors of the small dense matrices that are left when an interior is eliminated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from cembench.clock import phase
from cembench.errors import NotPositiveDefinite

Real = NDArray[np.float64]


class DenseCholesky:
    """Solves systems with a small dense symmetric positive definite matrix.

    Raises
    ------
    NotPositiveDefinite
        It is not.

    """

    def __init__(self, A: Real) -> None:
        with phase("dense factorisation"):
            try:
                self._factor = linalg.cho_factor(A, lower=True, check_finite=False)
            except linalg.LinAlgError as error:
                raise NotPositiveDefinite(
                    f"the dense matrix of order {len(A)} is not positive definite ({error})"
                ) from None

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """A x = b, real or complex."""
        with phase("solves"):
            if np.iscomplexobj(b):  # LAPACK would make a complex copy of the factor
                return self._solve(b.real) + 1j * self._solve(b.imag)
            return self._solve(b)

    def _solve(self, b: Real) -> Real:
        x: Real = linalg.cho_solve(self._factor, b, check_finite=False)
        return x
