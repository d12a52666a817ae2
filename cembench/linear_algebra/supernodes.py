"""Trailing block and order of CHOLMOD's supernodal factor, for which cvxopt has no functions.

cvxopt returns a factor as a capsule around CHOLMOD's ``cholmod_factor``, a structure whose layout
is the same in versions 2 to 5 (SuiteSparse 4 to 7). It is only read, and only after its plain
numbers have confirmed the expected layout.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBERS_BEFORE = ("n", "minor")
_POINTERS = ("Perm", "ColCount", "IPerm")
_SIMPLICIAL = ("nzmax", "p", "i", "x", "z", "nz", "next", "prev")
_SUPERNODAL = ("nsuper", "ssize", "xsize", "maxcsize", "maxesize", "super", "pi", "px", "s")
_FLAGS = ("ordering", "is_ll", "is_super", "is_monotonic", "itype", "xtype", "dtype")


class _CholmodFactor(ctypes.Structure):
    """The layout of CHOLMOD's factor."""

    # Sizes and pointers have the same width; a null pointer reads as 0.
    _fields_ = [
        *((name, ctypes.c_size_t) for name in _NUMBERS_BEFORE + _POINTERS),
        *((name, ctypes.c_size_t) for name in _SIMPLICIAL + _SUPERNODAL),
        *((name, ctypes.c_int) for name in _FLAGS),
    ]


def trailing_block(factor: Any, n: int, leading: int) -> NDArray[np.float64] | None:
    """Return the last rows and columns of a factor, from `leading` on.

    Parameters
    ----------
    factor : capsule
        A numeric factor by ``cvxopt.cholmod`` of a matrix of order n, whose permutation leaves the
        rows from `leading` on in place.
    n, leading : int
        The order of the matrix, and where the block begins.

    Returns
    -------
    C : float64 (n - leading, n - leading), Fortran order
        Lower triangular with positive diagonal; None if the structure is not as expected.

    """
    held = _held(factor)
    if held is None or not _as_expected(held, n):
        return None
    first = _array(held.super, ctypes.c_int64, held.nsuper + 1)  # columns of each supernode
    row_at = _array(held.pi, ctypes.c_int64, held.nsuper + 1)
    value_at = _array(held.px, ctypes.c_int64, held.nsuper + 1)
    rows_of = _array(held.s, ctypes.c_int64, held.ssize)
    values = _array(held.x, ctypes.c_double, held.xsize)
    order = _array(held.Perm, ctypes.c_int64, n)
    if first[-1] != n or not (order[leading:] == np.arange(leading, n)).all():
        return None
    C = np.zeros((n - leading, n - leading), order="F")
    for k in range(int(np.searchsorted(first, leading, side="right")) - 1, held.nsuper):
        rows = rows_of[row_at[k] : row_at[k + 1]]
        columns = np.arange(first[k], first[k + 1])
        dense = values[value_at[k] : value_at[k] + len(rows) * len(columns)]
        dense = dense.reshape(len(columns), len(rows)).T
        top, left = np.searchsorted(rows, leading), np.searchsorted(columns, leading)
        here = slice(int(columns[left]) - leading, int(columns[-1]) + 1 - leading)
        below = rows[top:] - leading
        if len(below) == below[-1] + 1 - below[0]:
            C[below[0] : below[-1] + 1, here] = dense[top:, left:]
        else:
            C[below, here] = dense[top:, left:]
        # Entries above the diagonal of a supernode are undefined.
        C[here, here] = np.tril(C[here, here])
    return C


def factor_entries(factor: Any) -> int:
    """Return the number of entries of a supernodal factor; 0 for an unexpected structure."""
    held = _held(factor)
    return int(held.xsize) if held is not None and _as_expected(held, held.n) else 0


def order_of(factor: Any, n: int) -> NDArray[np.int64] | None:
    """Return the order of rows (n,) of a symbolic supernodal factor; None if it is unexpected."""
    held = _held(factor)
    if held is None or not _as_expected(held, n, numeric=False):
        return None
    return np.array(_array(held.Perm, ctypes.c_int64, n))


def _held(factor: Any) -> _CholmodFactor | None:
    """Return the structure in a capsule; None if the capsule is not as expected."""
    api = ctypes.pythonapi
    name_of, pointer_of = api.PyCapsule_GetName, api.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    name = name_of(factor)
    if name != b"CHOLMOD FACTOR D L":
        return None
    return ctypes.cast(pointer_of(factor, name), ctypes.POINTER(_CholmodFactor)).contents


def _as_expected(held: _CholmodFactor, n: int, *, numeric: bool = True) -> bool:
    """Whether this is a real supernodal factor L L^T of order n with 64-bit indices.

    A symbolic factor has no numbers yet.
    """
    flags = (held.is_ll, held.is_super, held.itype, held.xtype, held.dtype)
    sizes = 0 < held.nsuper <= n <= held.xsize and held.nsuper <= held.ssize
    return flags == (1, 1, 2, int(numeric), 0) and held.n == held.minor == n and sizes


def _array(address: int, kind: Any, length: int) -> NDArray[Any]:
    """Return the array at an address, without a copy."""
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(kind)), (length,))
