"""Sparse factorisation by SciPy's SuperLU in symmetric mode: the fallback that is always there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.work import count_analysis, count_factorisation


def superlu_solver(A: sparse.csc_array) -> Callable[[Real], Real]:
    """Factor A and return a function that solves A X = B for real columns B (n, k).

    Raises
    ------
    NotPositiveDefinite
        The matrix is singular, or has a pivot that is not positive.
    """
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
        count_analysis()
        count_factorisation(A.shape[0], lambda: int(factor.nnz) // 2)
        # With diagonal pivots, these are the D of L D L^T: all positive if A is definite.
        pivots = factor.U.diagonal()
        if not (pivots > 0).all():
            raise NotPositiveDefinite(
                f"the matrix of order {A.shape[0]} is not positive definite "
                f"(smallest pivot {pivots.min():.3g})"
            )
    return lambda B: np.asarray(factor.solve(B))
