"""The energy of harmonic maps as a quadratic form in their boundary values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.triangular import triangle_solved, triangle_times

Real = NDArray[np.float64]


class DirichletToNeumann:
    """S = L_bb - L_bi L_ii^-1 L_ib: a harmonic map with boundary f_b has E_D = f_b^* S f_b / 2.

    Parameters
    ----------
    C : float (B - 1, B - 1), Fortran order
        Lower triangular; C C^T is S without its last row and column. They follow from the others,
        since the rows of S sum to zero.

    Both products cost B^2 operations; S itself is never formed.

    """

    def __init__(self, C: Real) -> None:
        self._C = C

    def __call__(self, f: NDArray[Any]) -> NDArray[Any]:
        """S f for f (B,) or (B, k), real or complex."""
        found = by_real_columns(self._product, (f - f[-1])[:-1])
        return np.concatenate([found, -found.sum(axis=0, keepdims=True)])

    def inverse(self, g: Real) -> Real:
        """(S + m m^T)^-1 g with m = 1 / B: what inverts S up to its constants; g (B,) or (B, k)."""
        total = g.sum(axis=0)
        x = by_real_columns(self._solution, (g - total / len(g))[:-1])
        mean = x.sum(axis=0) / len(g)
        return np.concatenate([x - mean + total, (total - mean)[None]])

    def _product(self, X: Real) -> Real:
        return triangle_times(self._C, triangle_times(self._C, X, transposed=True))

    def _solution(self, X: Real) -> Real:
        return triangle_solved(self._C, triangle_solved(self._C, X), transposed=True)
