"""Names of arrays, for annotations; marks and numbers of some of n things."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
#: Coordinates, a row for each vertex.
Points = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Vertices of a boundary loop, in order.
Loop = Indices
Mask = NDArray[np.bool_]
#: Rows of pixels, with channels.
Picture = NDArray[np.uint8]


def marked(n: int, some: Any) -> Mask:
    """Return whether each of the numbers 0 to n - 1 is one of these; integers of any shape.

    >>> marked(3, [0, 2]).tolist()
    [True, False, True]
    """
    mask = np.zeros(n, dtype=bool)
    mask[some] = True
    return mask


def numbered(n: int, some: Indices) -> Indices:
    """Return the place of each of the numbers 0 to n - 1 among these; -1 for one that is not.

    >>> numbered(3, np.array([2, 0])).tolist()
    [1, -1, 0]
    """
    place = np.full(n, -1)
    place[some] = np.arange(len(some))
    return place
