"""The one sparse Cholesky class that all algorithms use, so that none wins by a better solver.

Which library factors, and whether a factor is kept, is decided by whoever measures, through
:func:`linear_algebra`, and cannot be seen by the algorithm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite, ParameterError
from cembench.core.extras import Extra, command
from cembench.linear_algebra.backends import Backend, available_backends, default_backend
from cembench.linear_algebra.lower_triangle import both_triangles
from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.work import count_columns

Solves = Literal["reuse", "backslash"]


@dataclass(frozen=True)
class LinearAlgebra:
    """How linear systems are solved.

    solves : "reuse" keeps a factor while its matrix stands; "backslash" factors anew at every
        solve, as the paper's MATLAB did.
    backend : the library that factors.
    """

    solves: Solves = "reuse"
    backend: Backend = field(default_factory=default_backend)


#: Right-hand sides that are solved for together: enough to be fast, few enough to need no memory.
_COLUMNS_AT_ONCE = 64

#: Up to this order the block behind a leading one is kept dense, as it fills up when the leading
#: block is eliminated: beyond it its n^3 operations and n^2 numbers are worth avoiding.
LARGEST_DENSE = 5_000

_DEFAULT = LinearAlgebra()
_current: ContextVar[LinearAlgebra] = ContextVar("cembench_linear_algebra", default=_DEFAULT)


@contextmanager
def linear_algebra(solves: str = "reuse", backend: str | None = None) -> Iterator[LinearAlgebra]:
    """Let everything enclosed solve its systems this way.

    Raises
    ------
    ParameterError
        An unknown policy or backend, or one whose library is not installed.

    """
    if solves not in get_args(Solves):
        raise ParameterError(f"solves={solves!r} is unknown; allowed: {_names(Solves)}.")
    backend = backend or default_backend()
    if backend not in get_args(Backend):
        raise ParameterError(f"backend={backend!r} is unknown; allowed: {_names(Backend)}.")
    if backend not in available_backends():
        brings = command(Extra.PARDISO) if backend == Extra.PARDISO else f"pip install {backend}"
        raise ParameterError(
            f"backend={backend!r} is not installed; install it with `{brings}`, or use one of: "
            f"{', '.join(available_backends())}."
        )
    choice = LinearAlgebra(solves, backend)  # type: ignore[arg-type]  # checked above
    _factor_class(choice.backend)  # loads the library now, not inside what is timed
    token = _current.set(choice)
    try:
        yield choice
    finally:
        _current.reset(token)


def _names(kind: Any) -> str:
    return ", ".join(repr(name) for name in get_args(kind))


def shows_trailing_block() -> bool:
    """Does a factor, as systems are solved here, show its trailing block, so that solves halve?"""
    how = _current.get()
    return how.solves == "reuse" and how.backend == "cvxopt"


Solver = Callable[[NDArray[np.float64]], NDArray[np.float64]]
SolverOf = Callable[[sparse.csc_array], Solver]


class _Factor(Protocol):
    def update(self, A: sparse.csc_array) -> None: ...
    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def schur_factor(self) -> NDArray[np.float64] | None: ...
    def solve_trailing(self, B: NDArray[np.float64]) -> NDArray[np.float64] | None: ...
    def condensed(self, B: NDArray[np.float64]) -> NDArray[np.float64] | None: ...
    def extended(self, B: NDArray[np.float64]) -> NDArray[np.float64] | None: ...


class Cholesky:
    """Solves systems with a sparse symmetric positive definite matrix.

    Parameters
    ----------
    A : sparse (n, n)
        Symmetric positive definite, both triangles stored.
    lower : bool
        A holds its lower triangle alone, each column from top to bottom.
    leading : int, optional
        Also solve with the block ``A[:leading, :leading]``; under "reuse" from the same factor,
        unless more than :data:`LARGEST_DENSE` rows follow it: then it has a factor of its own.

    Raises
    ------
    NotPositiveDefinite
        At construction or, under "backslash", at the first solve.

    """

    def __init__(
        self, A: sparse.sparray, *, leading: int | None = None, lower: bool = False
    ) -> None:
        self._given, self._lower = sparse.csc_array(A), lower
        self._leading = leading
        self._how = _current.get()
        self._kept: _Factor | None = None
        if self._how.solves == "reuse":
            self._kept = _factor(self._how.backend, self._read, leading)

    @property
    def _read(self) -> sparse.csc_array:
        """What the library is given: CHOLMOD reads no more than the lower triangle."""
        return self._given if self._how.backend == "cvxopt" else self._A

    @cached_property
    def _A(self) -> sparse.csc_array:
        """Both triangles."""
        return both_triangles(self._given) if self._lower else self._given

    def update(self, A: sparse.sparray) -> None:
        """Turn to another matrix with the same pattern; under "reuse" its analysis is kept.

        Both triangles are stored, or one, as at construction.
        """
        self._given = sparse.csc_array(A)
        vars(self).pop("_A", None)
        if self._kept is not None:
            self._kept.update(self._read)

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """A x = b; b (n,) or (n, k), real or complex; x alike."""
        factor = self._kept or _factor(self._how.backend, self._A, None)
        _count(b)
        with phase("solves"):
            return by_real_columns(factor.solve, b)

    def solve_leading(self, b: NDArray[Any]) -> NDArray[Any]:
        """A[:leading, :leading] x = b; b (leading,) or (leading, k), real or complex; x alike."""
        if self._leading is None:
            raise ValueError("solve_leading needs the order of the leading block at construction")
        _count(b)
        if self._kept is not None:
            with phase("solves"):
                return by_real_columns(self._kept.solve_leading, b)
        factor = self._leading_factor()
        with phase("solves"):
            return by_real_columns(factor.solve, b)

    def schur_factor(self) -> NDArray[np.float64]:
        """What is the Cholesky factor of the Schur complement of the leading block?

        With A = [[B, E^T], [E, D]], B the leading block, that is the lower triangular C, dense,
        with C C^T = D - E B^-1 E^T. A factor of A holds it as its trailing block; where a library
        does not show that, or under "backslash", it takes one solve with as many right-hand sides
        as E has rows.
        """
        if self._leading is None:
            raise ValueError("schur_factor needs the order of the leading block at construction")
        with phase("schur complement"):
            C = self._kept.schur_factor() if self._kept is not None else None
        return self._schur_factor_by_solves() if C is None else C

    @property
    def halves(self) -> bool:
        """Are :meth:`solve_trailing`, :meth:`condensed` and :meth:`extended` half a solve each?"""
        return self._kept is not None and self._kept.schur_factor() is not None

    def solve_trailing(self, b: NDArray[Any]) -> NDArray[Any]:
        """The entries of A x = b behind the leading block; b (n,) or (n, k), real or complex.

        With a factor that shows its trailing block that is half a solve: the leading block's share
        of the back substitution is left out.
        """
        if self._kept is not None and self.halves:
            _count(b, 0.5)
            with phase("solves"):
                return by_real_columns(self._kept.solve_trailing, b)
        return self.solve(b)[self._leading :]

    def condensed(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is left of a right-hand side b = (c, d) when the leading block is eliminated?

        d - E B^-1 c, in the letters of :meth:`schur_factor`; b (n, k), the result
        (n - leading, k). With a factor that shows its trailing block that is half a solve.
        """
        k = self._leading
        if self._kept is not None:
            with phase("solves"):
                found = self._kept.condensed(b)
            if found is not None:
                _count(b, 0.5)
                return found
        return b[k:] - sparse.csr_array(self._A[k:, :k]) @ self.solve_leading(b[:k])

    def extended(self, x: NDArray[Any]) -> NDArray[Any]:
        """Which solution of B y + E^T x = 0 has these trailing values x, real or complex?

        x (n - leading,) or (n - leading, k), y alike; half a solve as in :meth:`condensed`.
        """
        k = self._leading
        if self._kept is not None and self.halves:
            _count(x, 0.5)
            with phase("solves"):
                return by_real_columns(self._kept.extended, x)
        return -self.solve_leading(sparse.csr_array(self._A[:k, k:]) @ x)

    def schur_times(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """S x for the Schur complement S of :meth:`schur_factor`, by one solve; x (m, k)."""
        k = self._leading
        E, D = sparse.csr_array(self._A[k:, :k]), self._A[k:, k:]
        return D @ x - E @ self.solve_leading(E.T @ x)

    def schur_solved(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """S^-1 x, likewise: what A^-1 has in the place of S^-1."""
        padded = np.zeros((self._A.shape[0], x.shape[1]))
        padded[self._leading :] = x
        return self.solve(padded)[self._leading :]

    def _schur_factor_by_solves(self) -> NDArray[np.float64]:
        k = self._leading
        solve = self._kept.solve_leading if self._kept else self._leading_factor().solve
        with phase("schur complement"):
            E = sparse.csr_array(self._A[k:, :k])
            S = self._A[k:, k:].toarray()
            for first in range(0, E.shape[0], _COLUMNS_AT_ONCE):
                chosen = slice(first, first + _COLUMNS_AT_ONCE)
                right = E[chosen].toarray().T
                _count(right)
                S[:, chosen] -= E @ solve(right)
            try:
                return np.asfortranarray(np.linalg.cholesky((S + S.T) / 2))
            except np.linalg.LinAlgError:
                raise NotPositiveDefinite(
                    f"the Schur complement, of order {len(S)}, is not positive definite"
                ) from None

    def _leading_factor(self) -> _Factor:
        block = sparse.csc_array(self._A[: self._leading, : self._leading])
        return _factor(self._how.backend, block, None)


def _count(b: NDArray[Any], share: float = 1.0) -> None:
    """Count the real columns of right-hand sides (n,) or (n, k)."""
    columns = b.size // max(1, len(b))
    count_columns(share * columns * (2 if np.iscomplexobj(b) else 1))


def _factor(backend: Backend, A: sparse.csc_array, leading: int | None) -> _Factor:
    if backend == "cvxopt" and leading is not None and A.shape[0] - leading > LARGEST_DENSE:
        from cembench.linear_algebra.cholmod import cholmod_solver

        return _SeparateFactors(cholmod_solver, A, leading)
    return _factor_class(backend)(A, leading)


def _factor_class(backend: Backend) -> Callable[[sparse.csc_array, int | None], _Factor]:
    # Imported on demand: an extra may be missing, and starting up should load no solver.
    if backend == "cvxopt":
        from cembench.linear_algebra.cholmod import CholmodFactor

        return CholmodFactor
    if backend == "superlu":
        from cembench.linear_algebra.superlu import superlu_solver

        return partial(_SeparateFactors, superlu_solver)
    from cembench.linear_algebra.pardiso import pardiso_solver

    return partial(_SeparateFactors, pardiso_solver)


class _SeparateFactors:
    """For factors that solve only as a whole: the leading block gets one of its own.

    It is factored when first used. Nothing is kept over an update.
    """

    def __init__(self, solver_of: SolverOf, A: sparse.csc_array, leading: int | None) -> None:
        self._solver_of, self._leading = solver_of, leading
        self.update(A)

    def update(self, A: sparse.csc_array) -> None:
        self._solve = self._solver_of(A)
        self._solve_leading: Solver | None = None
        self._A = A

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._solve(B)

    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._solve_leading is None:
            k = self._leading
            self._solve_leading = self._solver_of(sparse.csc_array(self._A[:k, :k]))
        return self._solve_leading(B)

    def schur_factor(self) -> None:
        """These factors are not shown."""

    def solve_trailing(self, B: NDArray[np.float64]) -> None:
        """Nor half a solve."""

    def condensed(self, B: NDArray[np.float64]) -> None:
        """Nor half a solve."""

    def extended(self, B: NDArray[np.float64]) -> None:
        """Nor half a solve."""
