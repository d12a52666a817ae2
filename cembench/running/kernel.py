"""The reference kernel: fixed work that every round times, so that two runs can be compared.

A sparse factorisation by SciPy, of a Laplacian on a square grid: nothing of it is cembench's, so no
change of cembench's makes it faster. What slows the machine slows it too.
"""

from __future__ import annotations

from functools import lru_cache
from statistics import median
from time import perf_counter
from typing import Any

import scipy.sparse as sparse
from scipy.sparse.linalg import splu

#: Points on a side of the grid, and how often it is factored each time.
SIDE, TIMES = 70, 3


@lru_cache(maxsize=1)
def _laplacian() -> Any:
    line = sparse.diags([-1.0, 2.001, -1.0], [-1, 0, 1], shape=(SIDE, SIDE))
    one = sparse.identity(SIDE)
    return (sparse.kron(line, one) + sparse.kron(one, line)).tocsc()


def kernel_seconds() -> float:
    """Return the wall-clock seconds of one factorisation, the median of a few, in this process."""
    matrix = _laplacian()
    return median(_timed(matrix) for _ in range(TIMES))


def _timed(matrix: Any) -> float:
    started = perf_counter()
    splu(matrix)
    return perf_counter() - started
