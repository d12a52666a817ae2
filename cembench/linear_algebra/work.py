"""Count factorisations and solves: the linear algebra of an algorithm, independent of any clock.

Outside :func:`counting` the cost is one look at a variable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass
class Work:
    """Counts of the linear algebra that was requested.

    Attributes
    ----------
    symbolic, numeric : int
        Sparse analyses (an ordering and the pattern of a factor) and factorisations.
    right_hand_sides : float
        Real columns that sparse systems were solved for. A complex column counts twice, half a
        solve (one of the two triangles) counts half.
    order, entries : int
        Largest order of a sparse matrix, and most entries of a factor; 0 if the library does not
        report it.
    dense, dense_order : int
        Dense factorisations, and the largest order of one.
    """

    symbolic: int = 0
    numeric: int = 0
    right_hand_sides: float = 0.0
    order: int = 0
    entries: int = 0
    dense: int = 0
    dense_order: int = 0


_work: ContextVar[Work | None] = ContextVar("cembench_work", default=None)


@contextmanager
def counting() -> Iterator[Work]:
    """Count the factorisations and solves inside the ``with`` block.

    Yields
    ------
    Work
        The counts so far; final after the block.

    Examples
    --------
    >>> from cembench.linear_algebra.cholesky import Cholesky
    >>> import numpy as np
    >>> from scipy import sparse
    >>> with counting() as work:
    ...     x = Cholesky(sparse.eye_array(4)).solve(np.ones((4, 3)))
    >>> work.numeric, work.right_hand_sides, work.order
    (1, 3.0, 4)
    """
    token = _work.set(Work())
    try:
        work = _work.get()
        assert work is not None
        yield work
    finally:
        _work.reset(token)


def count_analysis() -> None:
    """Count a symbolic analysis."""
    work = _work.get()
    if work is not None:
        work.symbolic += 1


def count_factorisation(order: int, entries: Callable[[], int]) -> None:
    """Count a sparse factorisation; `entries` returns the entries of its factor."""
    work = _work.get()
    if work is not None:
        work.numeric += 1
        work.order = max(work.order, order)
        work.entries = max(work.entries, entries())


def count_columns(columns: float) -> None:
    """Count real right-hand sides."""
    work = _work.get()
    if work is not None:
        work.right_hand_sides += columns


def count_dense(order: int) -> None:
    """Count a dense factorisation."""
    work = _work.get()
    if work is not None:
        work.dense += 1
        work.dense_order = max(work.dense_order, order)
