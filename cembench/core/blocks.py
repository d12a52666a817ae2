"""Parts of long arrays that stay in a processor's cache while they are worked on."""

from __future__ import annotations

from collections.abc import Iterator

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
