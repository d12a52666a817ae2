"""Products with small dense triangular matrices and their inverses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from cembench.core.arrays import Real

#: Up to this many columns, BLAS is faster column by column: its block routines copy the triangle.
_FEW = 4


def triangle_times(C: Real, X: Real, *, transposed: bool = False) -> Real:
    """Return C X or C^T X for lower triangular C (B, B) in Fortran order and X (B, k)."""
    if X.shape[1] > _FEW:
        return np.asarray(scipy.linalg.blas.dtrmm(1.0, C, X, lower=1, trans_a=transposed))
    return _by_column(lambda x: scipy.linalg.blas.dtrmv(C, x, lower=1, trans=transposed), X)


def triangle_solved(C: Real, X: Real, *, transposed: bool = False) -> Real:
    """Return C^-1 X or C^-T X; arguments as for :func:`triangle_times`."""
    if X.shape[1] > _FEW:
        return np.asarray(scipy.linalg.blas.dtrsm(1.0, C, X, lower=1, trans_a=transposed))
    return _by_column(lambda x: scipy.linalg.blas.dtrsv(C, x, lower=1, trans=transposed), X)


def _by_column(one: Callable[[Real], Real], X: Real) -> Real:
    """Apply a function to each column."""
    solved = np.empty(X.shape, order="F")
    for k in range(X.shape[1]):
        solved[:, k] = one(X[:, k])
    return solved
