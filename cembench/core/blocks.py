"""Parts of long arrays that stay in a processor's cache while they are worked on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rows of a block: a few arrays of three numbers each fit into the cache of a core.
ROWS = 1 << 14


def blocks(rows: int) -> Iterator[slice]:
    """Yield consecutive slices that cover this many rows.

    Examples
    --------
    >>> list(blocks(20_000))
    [slice(0, 16384, None), slice(16384, 20000, None)]
    """
    for start in range(0, rows, ROWS):
        yield slice(start, min(start + ROWS, rows))


def in_blocks(of_rows: Callable[[NDArray[Any]], NDArray[Any]], rows: NDArray[Any]) -> NDArray[Any]:
    """Return a function of each row of an array, computed a block of rows at a time.

    Examples
    --------
    >>> import numpy as np
    >>> in_blocks(lambda rows: rows.sum(axis=1), np.ones((20_000, 3))).shape
    (20000,)
    """
    if len(rows) <= ROWS:
        return of_rows(rows)
    return np.concatenate([of_rows(rows[block]) for block in blocks(len(rows))])
