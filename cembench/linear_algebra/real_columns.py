"""Apply real linear maps to vectors and complex numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Real


def by_real_columns(linear: Callable[[Real], Any], b: NDArray[Any]) -> NDArray[Any]:
    """Apply a linear map of real columns (n, k), in Fortran order, to b.

    b is (n,) or (n, k), real or complex. The result has the same form, with as many rows as the map
    returns.
    """
    columns = b.reshape(len(b), -1)
    k = columns.shape[1]
    if not np.iscomplexobj(b):
        x = linear(np.asfortranarray(columns, dtype=np.float64))
        return np.asarray(x).reshape((-1, *b.shape[1:]))
    parts = np.empty((len(b), 2 * k), order="F")
    parts[:, :k], parts[:, k:] = columns.real, columns.imag
    x = np.asarray(linear(parts))
    return (x[:, :k] + 1j * x[:, k:]).reshape((-1, *b.shape[1:]))
