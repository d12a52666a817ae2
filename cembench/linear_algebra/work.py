"""Count factorisations and solves: what an algorithm asks of linear algebra, whatever the clock.

Outside :func:`counting` a look at one variable is all that it costs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass
class Work:
    """What was asked of linear algebra.

    symbolic, numeric : sparse analyses (an ordering and the pattern of a factor) and factorisations
    right_hand_sides : real columns that sparse systems were solved for; a complex one counts twice,
        half a solve (one of the two triangles) counts half
    order, entries : the largest order of a sparse matrix, and the most entries of a factor;
        0 where the library does not tell
    dense, dense_order : dense factorisations, and the largest order of one
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
    """Count what everything enclosed asks for.

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
    """Count an ordering with the pattern of its factor."""
    work = _work.get()
    if work is not None:
        work.symbolic += 1


def count_factorisation(order: int, entries: Callable[[], int]) -> None:
    """Count the factorisation of a sparse matrix; `entries` tells those of its factor."""
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
    """Count the factorisation of a dense matrix."""
    work = _work.get()
    if work is not None:
        work.dense += 1
        work.dense_order = max(work.dense_order, order)
