"""The reference kernel: fixed work, timed in every round, that makes two runs comparable.

It is a sparse factorisation by SciPy of a Laplacian on a square grid. It uses no code of cembench,
so no change of cembench makes it faster; whatever slows the machine slows it too.
"""

from __future__ import annotations

from functools import lru_cache
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

#: Points along a side of the grid.
SIDE = 70
#: Bytes of an array that is freed before: from then on glibc gives blocks of up to that size from
#: the heap and keeps what is freed, as it does anyway in a process that has freed such an array.
#: It is just below the largest size for which glibc does so.
FREED = 31 * 2**20
#: Factorisations for each process of the round that is timed, and at most: what disturbs a few of
#: them must not decide the figure of a whole round, and one of a single process must cost little.
FOR_EACH, AT_MOST = 3, 45


@lru_cache(maxsize=1)
def _laplacian() -> Any:
    line = sparse.diags([-1.0, 2.001, -1.0], [-1, 0, 1], shape=(SIDE, SIDE))
    one = sparse.identity(SIDE)
    return (sparse.kron(line, one) + sparse.kron(one, line)).tocsc()


def kernel_seconds(processes: int = 1) -> float:
    """Return the wall-clock seconds of a factorisation in this process.

    It is the median of more factorisations if the round has more processes. The first one makes the
    heap as large as they need and is not timed.
    """
    matrix = _laplacian()
    np.empty(FREED, dtype=np.uint8)
    splu(matrix)
    return median(_timed(matrix) for _ in range(min(FOR_EACH * processes, AT_MOST)))


def _timed(matrix: Any) -> float:
    started = perf_counter()
    splu(matrix)
    return perf_counter() - started
