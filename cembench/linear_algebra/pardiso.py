"""Sparse Cholesky by MKL Pardiso; requires the extra ``cembench[pardiso]``."""

from __future__ import annotations

import weakref
from collections.abc import Callable

import numpy as np
import pypardiso
from pypardiso.pardiso_wrapper import PyPardisoError
from scipy import sparse

from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.work import count_analysis, count_factorisation

#: Pardiso's matrix type for real symmetric positive definite.
_SPD = 2


def pardiso_solver(A: sparse.csc_array) -> Callable[[Real], Real]:
    """Factor A and return a function that solves A X = B for real columns B (n, k).

    Raises
    ------
    NotPositiveDefinite
        The factorisation broke down.
    """
    with phase("factorisation"):
        # Pardiso reads the upper triangle by rows and needs every diagonal entry stored.
        upper = sparse.csr_matrix(sparse.triu(A, format="csr"))
        solver = pypardiso.PyPardisoSolver(mtype=_SPD)
        try:
            solver.factorize(upper)
        except PyPardisoError as error:
            solver.free_memory(everything=True)
            raise NotPositiveDefinite(
                f"the matrix of order {A.shape[0]} is not positive definite ({error})"
            ) from None

        count_analysis()
        count_factorisation(A.shape[0], lambda: 0)

    def solve(B: Real) -> Real:
        return np.asarray(solver.solve(upper, np.asfortranarray(B)))

    weakref.finalize(solve, solver.free_memory, everything=True)
    return solve
