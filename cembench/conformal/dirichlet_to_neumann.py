"""The energy of harmonic maps as a quadratic form in their boundary values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Real
from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.triangular import triangle_solved, triangle_times


class DirichletToNeumann:
    """S = L_bb - L_bi L_ii^-1 L_ib: a harmonic map with boundary f_b has E_D = f_b^* S f_b / 2.

    S itself is never formed. Its last row and column follow from the others, since rows of S sum to
    zero.

    Parameters
    ----------
    times, solved : callable
        Products with (B - 1, k) of S without its last row and column, and of the inverse of that.
    """

    def __init__(self, times: Callable[[Real], Real], solved: Callable[[Real], Real]) -> None:
        self._times, self._solved = times, solved

    @classmethod
    def of_factor(cls, C: Real) -> Self:
        """Return S from its lower triangular factor C (B - 1, B - 1); B^2 operations a product."""
        return cls(
            lambda X: triangle_times(C, triangle_times(C, X, transposed=True)),
            lambda X: triangle_solved(C, triangle_solved(C, X), transposed=True),
        )

    def __call__(self, f: NDArray[Any]) -> NDArray[Any]:
        """Return S f for f (B,) or (B, k), real or complex."""
        derivative = by_real_columns(self._times, (f - f[-1])[:-1])
        return np.concatenate([derivative, -derivative.sum(axis=0, keepdims=True)])

    def inverse(self, g: Real) -> Real:
        """Return (S + m m^T)^-1 g with m = 1 / B, the inverse up to constants; g (B,) or (B, k)."""
        total = g.sum(axis=0)
        x = by_real_columns(self._solved, (g - total / len(g))[:-1])
        mean = x.sum(axis=0) / len(g)
        return np.concatenate([x - mean + total, (total - mean)[None]])
