"""The sparse Cholesky class that all algorithms share, so that none wins by a better solver.

The library that factors, and whether a factor is reused, are set by the caller through
:func:`linear_algebra`. Algorithms cannot see them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite, ParameterError
from cembench.core.extras import command
from cembench.linear_algebra.backends import (
    EXTRAS,
    Backend,
    available_backends,
    default_backend,
    uses_cholmod,
)
from cembench.linear_algebra.lower_triangle import both_triangles
from cembench.linear_algebra.real_columns import by_real_columns
from cembench.linear_algebra.work import count_columns

if TYPE_CHECKING:
    from cembench.linear_algebra.cholmod import Order

Solves = Literal["reuse", "backslash"]


@dataclass(frozen=True)
class LinearAlgebra:
    """How linear systems are solved.

    Parameters
    ----------
    solves : {"reuse", "backslash"}
        "reuse" uses a factorisation as long as its matrix does not change; "backslash" factors
        again for every solve, as the paper's MATLAB code did.
    backend : str
        The library that factors.
    """

    solves: Solves = "reuse"
    backend: Backend = field(default_factory=default_backend)


#: Right-hand sides per solve: enough to be fast, few enough to use little memory.
_COLUMNS_AT_ONCE = 64

#: Largest order at which the block after a leading one is stored dense. Eliminating the leading
#: block fills it; above this order its n^3 operations and n^2 numbers cost too much.
LARGEST_DENSE = 5_000

_DEFAULT = LinearAlgebra()
_current: ContextVar[LinearAlgebra] = ContextVar("cembench_linear_algebra", default=_DEFAULT)


@contextmanager
def linear_algebra(solves: str = "reuse", backend: str | None = None) -> Iterator[LinearAlgebra]:
    """Use this policy and back end for all systems solved inside the ``with`` block.

    Parameters
    ----------
    solves : {"reuse", "backslash"}
        Whether to reuse a factorisation or to factor for every solve.
    backend : {"cvxopt", "cvxopt-metis", "superlu", "pardiso"}, optional
        The library that factors (default: cvxopt, or superlu if cvxopt is missing); cvxopt-metis
        orders the rows by nested dissection instead of minimum degree.

    Yields
    ------
    LinearAlgebra
        The settings.

    Raises
    ------
    ParameterError
        The policy or back end is unknown, or its library is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import sparse
    >>> with linear_algebra("backslash", "superlu"):
    ...     x = Cholesky(2 * sparse.eye_array(3)).solve(np.ones(3))
    >>> x
    array([0.5, 0.5, 0.5])
    """
    if solves not in get_args(Solves):
        raise ParameterError(f"solves={solves!r} is unknown; allowed: {_names(Solves)}.")
    backend = backend or default_backend()
    if backend not in get_args(Backend):
        raise ParameterError(f"backend={backend!r} is unknown; allowed: {_names(Backend)}.")
    if backend not in available_backends():
        brings = command(EXTRAS[backend]) if backend in EXTRAS else f"pip install {backend}"
        raise ParameterError(
            f"backend={backend!r} is not installed; install it with `{brings}`, or use one of: "
            f"{', '.join(available_backends())}."
        )
    choice = LinearAlgebra(solves, backend)  # type: ignore[arg-type]  # checked above
    _factor_class(choice.backend)  # import the library now, outside the timed code
    token = _current.set(choice)
    try:
        yield choice
    finally:
        _current.reset(token)


def _names(kind: Any) -> str:
    """Return the allowed values of a Literal type for a message."""
    return ", ".join(repr(name) for name in get_args(kind))


def keeps_factors() -> bool:
    """Whether a factor serves all solves here, so that a further solve is cheap."""
    return _current.get().solves == "reuse"


def shows_trailing_block() -> bool:
    """Whether factors show their trailing block here, so that solves can be halved."""
    how = _current.get()
    return how.solves == "reuse" and uses_cholmod(how.backend)


Solver = Callable[[NDArray[np.float64]], NDArray[np.float64]]
SolverOf = Callable[["scipy.sparse.csc_array"], Solver]


class _Factor(Protocol):
    """The interface of the factors of all back ends; `order` is that of the rows, if known."""

    order: NDArray[np.int64] | None

    def update(self, A: scipy.sparse.csc_array) -> None: ...
    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def schur_factor(self) -> NDArray[np.float64] | None: ...
    def solve_trailing(self, B: NDArray[np.float64]) -> NDArray[np.float64] | None: ...
    def condensed(self, B: NDArray[np.float64]) -> NDArray[np.float64] | None: ...
    def extended(
        self, B: NDArray[np.float64], rows: NDArray[np.int64] | None = None
    ) -> NDArray[np.float64] | None: ...
    def part(self, rows: NDArray[np.int64]) -> _Part | None: ...


class _Part(Protocol):
    """The part of a factor that substitutions between some rows pass."""

    share: float

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def solve_everywhere(self, B: NDArray[np.float64]) -> NDArray[np.float64]: ...


class Cholesky:
    """Solve systems with a sparse symmetric positive definite matrix.

    Parameters
    ----------
    A : sparse (n, n)
        Symmetric positive definite, both triangles stored.
    leading : int, optional
        Also solve with the block ``A[:leading, :leading]``. Under "reuse" the same factor is used,
        unless more than :data:`LARGEST_DENSE` rows follow the block; then it has its own factor.
    lower : bool
        A holds its lower triangle alone, each column from top to bottom.
    like : Cholesky, optional
        Order the rows as in that factorisation of another matrix of the same order, whose pattern
        is nearly the same. CHOLMOD does, other libraries order again.
    points : float (n, 3), optional
        Positions on a surface, of the vertices that the rows are for. The default back end then
        orders the rows by nested dissection of these, where minimum degree is slow: for a grid
        whose diagonals run either way. Neither this nor `like` goes with a leading block.

    Raises
    ------
    NotPositiveDefinite
        The matrix is not positive definite; raised at construction or, under "backslash", at the
        first solve.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import sparse
    >>> A = sparse.csc_array([[2.0, 1.0], [1.0, 2.0]])
    >>> Cholesky(A).solve(np.array([3.0, 3.0]))
    array([1., 1.])
    """

    def __init__(
        self,
        A: scipy.sparse.sparray,
        *,
        leading: int | None = None,
        lower: bool = False,
        like: Cholesky | None = None,
        points: NDArray[np.float64] | None = None,
    ) -> None:
        if leading is not None and not (like is None and points is None):
            raise ValueError("like and points need a matrix without a leading block")
        self._given, self._lower = scipy.sparse.csc_array(A), lower
        self._leading = leading
        self._how = _current.get()
        self._kept: _Factor | None = None
        if self._how.solves == "reuse":
            order = _known_order(self._how.backend, like, points)
            self._kept = _factor(self._how.backend, self._read, leading, order)

    @property
    def _read(self) -> scipy.sparse.csc_array:
        """What the library is given: CHOLMOD reads no more than the lower triangle."""
        return self._given if uses_cholmod(self._how.backend) else self._A

    @cached_property
    def _A(self) -> scipy.sparse.csc_array:
        """Both triangles."""
        return both_triangles(self._given) if self._lower else self._given

    def update(self, A: scipy.sparse.sparray) -> None:
        """Turn to another matrix with the same pattern; under "reuse" its analysis is kept.

        Both triangles are stored, or one, as at construction.
        """
        self._given = scipy.sparse.csc_array(A)
        vars(self).pop("_A", None)
        if self._kept is not None:
            self._kept.update(self._read)

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """Return x with A x = b; b is (n,) or (n, k), real or complex, and so is x."""
        factor = self._kept or _factor(self._how.backend, self._A, None)
        _count(b)
        with phase("solves"):
            return by_real_columns(factor.solve, b)

    def among(self, rows: NDArray[np.int64]) -> Among:
        """Return what solves systems with right-hand sides that are zero outside these rows."""
        if self._leading is not None:
            raise ValueError("among needs a matrix without a leading block")
        with phase("symbolic"):
            part = None if self._kept is None else self._kept.part(rows)
        return Among(self, rows, self._given.shape[0], part)

    def solve_leading(self, b: NDArray[Any]) -> NDArray[Any]:
        """Return x with A[:leading, :leading] x = b; shapes as for :meth:`solve`."""
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
        """Return the Cholesky factor C of the Schur complement of the leading block.

        With A = [[B, E^T], [E, D]] and B the leading block, C is lower triangular and dense, with C
        C^T = D - E B^-1 E^T. A factor of A contains C as its trailing block. If the library does
        not expose that, or under "backslash", C takes one solve with as many right-hand sides as E
        has rows.
        """
        if self._leading is None:
            raise ValueError("schur_factor needs the order of the leading block at construction")
        with phase("schur complement"):
            C = self._kept.schur_factor() if self._kept is not None else None
        return self._schur_factor_by_solves() if C is None else C

    @property
    def halves(self) -> bool:
        """Whether `solve_trailing`, `condensed` and `extended` are half a solve each."""
        return self._kept is not None and self._kept.schur_factor() is not None

    def solve_trailing(self, b: NDArray[Any]) -> NDArray[Any]:
        """The entries of A x = b behind the leading block; b (n,) or (n, k), real or complex.

        With a factor that shows its trailing block that is half a solve at most: the leading
        block's share of the back substitution is left out, and where b has few entries in that
        block, so is what does not lead from them to the trailing one.
        """
        if self._kept is not None and self.halves:
            with phase("solves"):
                return by_real_columns(self._kept.solve_trailing, b)
        return self.solve(b)[self._leading :]

    def condensed(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return d - E B^-1 c for right-hand sides b = (c, d): B eliminated, forward only.

        Letters as in :meth:`schur_factor`; b is (n, k), the result (n - leading, k). If the factor
        exposes its trailing block, this takes half a solve.
        """
        k = self._leading
        if self._kept is not None:
            with phase("solves"):
                block = self._kept.condensed(b)
            if block is not None:
                return block
        return b[k:] - scipy.sparse.csr_array(self._A[k:, :k]) @ self.solve_leading(b[:k])

    def extended(self, x: NDArray[Any], rows: NDArray[np.int64] | None = None) -> NDArray[Any]:
        """Return the y with B y + E^T x = 0 for given trailing values x, real or complex.

        x is (n - leading,) or (n - leading, k), and y (leading,) or (leading, k); half a solve as
        in :meth:`condensed`. With `rows`, only these of y are found: the share of it that leads
        from them to the trailing block.
        """
        k = self._leading
        if self._kept is not None and self.halves:
            with phase("solves"):
                return by_real_columns(partial(self._kept.extended, rows=rows), x)
        if rows is not None:
            return self.extended(x)[rows]
        return -self.solve_leading(scipy.sparse.csr_array(self._A[:k, k:]) @ x)

    def schur_times(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return S x for the Schur complement S of :meth:`schur_factor`, by one solve; x (m, k)."""
        k = self._leading
        E, D = scipy.sparse.csr_array(self._A[k:, :k]), self._A[k:, k:]
        return D @ x - E @ self.solve_leading(E.T @ x)

    def schur_solved(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return S^-1 x by one solve, as A^-1 contains S^-1 as a block; x (m, k)."""
        padded = np.zeros((self._A.shape[0], x.shape[1]))
        padded[self._leading :] = x
        return self.solve(padded)[self._leading :]

    def _schur_factor_by_solves(self) -> NDArray[np.float64]:
        k = self._leading
        solve = self._kept.solve_leading if self._kept else self._leading_factor().solve
        with phase("schur complement"):
            E = scipy.sparse.csr_array(self._A[k:, :k])
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
        block = scipy.sparse.csc_array(self._A[: self._leading, : self._leading])
        return _factor(self._how.backend, block, None)


def factor_like(earlier: Cholesky | None, A: scipy.sparse.sparray) -> Cholesky:
    """Return a factor of A; one of an `earlier` matrix of the same pattern turns to A."""
    if earlier is None:
        return Cholesky(A)
    earlier.update(A)
    return earlier


class Among:
    """Solve systems whose right-hand sides are zero outside some rows; made by `Cholesky.among`.

    If the factor shows its supernodes, only the columns that lead from these rows to the root of
    the elimination tree are passed; else these are usual solves.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import sparse
    >>> A = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(9, 9))
    >>> ends = Cholesky(A).among(np.array([0, 8]))
    >>> ends.solve(np.array([1.0, 0.0])).round(4)
    array([0.9, 0.1])
    """

    def __init__(
        self, whole: Cholesky, rows: NDArray[np.int64], n: int, part: _Part | None
    ) -> None:
        self._whole, self._rows, self._n, self._part = whole, rows, n, part

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """Return the entries at the rows of x with A x = b, for b at the rows and 0 elsewhere.

        b is (rows,) or (rows, k), real or complex, and so is x. Counted as the share of a solve
        that is passed.
        """
        if self._part is None:
            return self.solve_everywhere(b)[self._rows]
        _count(b, self._part.share)
        with phase("solves"):
            return by_real_columns(self._part.solve, b)

    def solve_everywhere(self, b: NDArray[Any]) -> NDArray[Any]:
        """Return all entries of x, (n,) or (n, k); half a solve is the same share of one."""
        if self._part is None:
            padded = np.zeros((self._n, *b.shape[1:]), dtype=b.dtype)
            padded[self._rows] = b
            return self._whole.solve(padded)
        _count(b, (1 + self._part.share) / 2)
        with phase("solves"):
            return by_real_columns(self._part.solve_everywhere, b)


def _count(b: NDArray[Any], share: float = 1.0) -> None:
    """Count the real columns of right-hand sides (n,) or (n, k)."""
    columns = b.size // max(1, len(b))
    count_columns(share * columns * (2 if np.iscomplexobj(b) else 1))


def _known_order(
    backend: Backend, like: Cholesky | None, points: NDArray[np.float64] | None
) -> Order | None:
    """Return what CHOLMOD orders the rows by, if that is not its own minimum degree."""
    if like is not None and like._kept is not None and like._kept.order is not None:
        order = like._kept.order
        return lambda _: order
    if points is not None and backend == "cvxopt":
        from cembench.linear_algebra.orderings import dissection_by_position

        return partial(dissection_by_position, points=points)
    return None


def _factor(
    backend: Backend,
    A: scipy.sparse.csc_array,
    leading: int | None,
    order: Order | None = None,
) -> _Factor:
    """Factor a matrix with a back end, its rows ordered like this by CHOLMOD."""
    of_class = _factor_class(backend, order)
    if uses_cholmod(backend) and leading is not None and A.shape[0] - leading > LARGEST_DENSE:
        return _SeparateFactors(lambda block: of_class(block, None).solve, A, leading)
    return of_class(A, leading)


def _factor_class(
    backend: Backend, order: Order | None = None
) -> Callable[[scipy.sparse.csc_array, int | None], _Factor]:
    """Return the constructor of a back end's factors; CHOLMOD's order their rows like this."""
    # Imported on demand: an extra may be missing, and start-up should not load a solver.
    if uses_cholmod(backend):
        from cembench.linear_algebra.cholmod import CholmodFactor
        from cembench.linear_algebra.orderings import minimum_degree, nested_dissection

        own = nested_dissection if backend == "cvxopt-metis" else minimum_degree
        return partial(CholmodFactor, order=order or own)
    if backend == "superlu":
        from cembench.linear_algebra.superlu import superlu_solver

        return partial(_SeparateFactors, superlu_solver)
    from cembench.linear_algebra.pardiso import pardiso_solver

    return partial(_SeparateFactors, pardiso_solver)


class _SeparateFactors:
    """A factor for libraries that only solve as a whole: the leading block has its own factor.

    The leading block is factored when first used; nothing is kept after an update.
    """

    order: NDArray[np.int64] | None = None

    def __init__(self, solver_of: SolverOf, A: scipy.sparse.csc_array, leading: int | None) -> None:
        self._solver_of, self._leading = solver_of, leading
        self.update(A)

    def update(self, A: scipy.sparse.csc_array) -> None:
        self._solve = self._solver_of(A)
        self._solve_leading: Solver | None = None
        self._A = A

    def solve(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._solve(B)

    def solve_leading(self, B: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._solve_leading is None:
            k = self._leading
            self._solve_leading = self._solver_of(scipy.sparse.csc_array(self._A[:k, :k]))
        return self._solve_leading(B)

    def schur_factor(self) -> None:
        """Return None: the library does not expose its factor."""

    def solve_trailing(self, B: NDArray[np.float64]) -> None:
        """Return None: the library has no half solves."""

    def condensed(self, B: NDArray[np.float64]) -> None:
        """Return None: the library has no half solves."""

    def extended(self, B: NDArray[np.float64], rows: NDArray[np.int64] | None = None) -> None:
        """Return None: the library has no half solves."""

    def part(self, rows: NDArray[np.int64]) -> None:
        """Return None: the library does not expose its factor."""
