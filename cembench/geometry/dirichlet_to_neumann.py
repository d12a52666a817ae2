"""The energy of harmonic maps as a quadratic form in their boundary values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrmm, dtrsm

Real = NDArray[np.float64]


class DirichletToNeumann:
    """S = L_bb - L_bi L_ii^-1 L_ib: a harmonic map with boundary f_b has E_D = f_b^* S f_b / 2.

    Parameters
    ----------
    C : float (B - 1, B - 1), Fortran order
        Lower triangular; C C^T is S without its last row and column. They follow from the others,
        since the rows of S sum to zero.

    Both products cost B^2 operations; S itself is never formed.

    """

    def __init__(self, C: Real) -> None:
        self._C = C

    def __call__(self, f: NDArray[Any]) -> NDArray[Any]:
        """S f for f (B,) or (B, k), real or complex."""
        pinned = (f - f[-1])[:-1]
        columns = _real_columns(pinned)
        product = dtrmm(1.0, self._C, columns, lower=1, trans_a=1)
        product = dtrmm(1.0, self._C, product, lower=1, overwrite_b=1)
        found = _like(product, pinned)
        return np.concatenate([found, -found.sum(axis=0, keepdims=True)])

    def inverse(self, g: Real) -> Real:
        """(S + m m^T)^-1 g with m = 1 / B: what inverts S up to its constants; g (B,) or (B, k)."""
        total = g.sum(axis=0)
        right = _real_columns((g - total / len(g))[:-1])
        x = dtrsm(1.0, self._C, right, lower=1)
        x = _like(dtrsm(1.0, self._C, x, lower=1, trans_a=1, overwrite_b=1), g)
        mean = x.sum(axis=0) / len(g)
        return np.concatenate([x - mean + total, (total - mean)[None]])


def _real_columns(f: NDArray[Any]) -> Real:
    flat = f.reshape(len(f), -1)
    if np.iscomplexobj(flat):
        flat = np.concatenate([flat.real, flat.imag], axis=1)
    return np.array(flat, order="F")


def _like(columns: Real, f: NDArray[Any]) -> NDArray[Any]:
    k = columns.shape[1] // 2
    if np.iscomplexobj(f):
        columns = columns[:, :k] + 1j * columns[:, k:]
    return columns.reshape((len(columns), *f.shape[1:]))
