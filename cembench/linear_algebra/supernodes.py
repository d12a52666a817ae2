"""Trailing block and order of CHOLMOD's supernodal factor, for which cvxopt has no functions.

cvxopt returns a factor as a capsule around CHOLMOD's ``cholmod_factor``, a structure whose layout
is the same in versions 2 to 5 (SuiteSparse 4 to 7). It is only read, and only after its plain
numbers have confirmed the expected layout.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Indices, Real

_NUMBERS_BEFORE = ("n", "minor")
_POINTERS = ("Perm", "ColCount", "IPerm")
_SIMPLICIAL = ("nzmax", "p", "i", "x", "z", "nz", "next", "prev")
_SUPERNODAL = ("nsuper", "ssize", "xsize", "maxcsize", "maxesize", "super", "pi", "px", "s")
#: The name of cvxopt's capsules around real supernodal factors.
CAPSULE = b"CHOLMOD FACTOR D L"
_FLAGS = ("ordering", "is_ll", "is_super", "is_monotonic", "itype", "xtype", "dtype")


class FactorStructure(ctypes.Structure):
    """The layout of CHOLMOD's factor, as far as it is the same in all versions."""

    # Sizes and pointers have the same width; a null pointer reads as 0.
    _fields_ = [
        *((name, ctypes.c_size_t) for name in _NUMBERS_BEFORE + _POINTERS),
        *((name, ctypes.c_size_t) for name in _SIMPLICIAL + _SUPERNODAL),
        *((name, ctypes.c_int) for name in _FLAGS),
    ]


class Supernodes(NamedTuple):
    """A supernodal factor's arrays, without copies. A supernode is a run of columns alike below."""

    #: First column of each supernode, and the number of columns.
    first: Indices
    #: Where the rows of each supernode begin, and the rows; the first are those of its columns.
    row_at: Indices
    rows: Indices
    #: Where the entries of each supernode begin, by columns, and the entries.
    value_at: Indices
    values: Real
    #: The row of the matrix at each row of the factor.
    order: Indices

    @classmethod
    def of(cls, held: FactorStructure) -> Self:
        """Return the arrays of a structure that is as expected."""
        return cls(
            _array(held.super, ctypes.c_int64, held.nsuper + 1),
            _array(held.pi, ctypes.c_int64, held.nsuper + 1),
            _array(held.s, ctypes.c_int64, held.ssize),
            _array(held.px, ctypes.c_int64, held.nsuper + 1),
            _array(held.x, ctypes.c_double, held.xsize),
            _array(held.Perm, ctypes.c_int64, held.n),
        )

    @property
    def widths(self) -> Indices:
        """Number of columns of each supernode."""
        return np.diff(self.first)

    @property
    def heights(self) -> Indices:
        """Number of rows of each supernode, those of its columns included."""
        return np.diff(self.row_at)

    def of_columns(self, columns: Indices) -> Indices:
        """Return the supernode of each column."""
        return np.searchsorted(self.first, columns, side="right") - 1

    def parents(self) -> Indices:
        """Return each supernode's parent in the elimination tree; -1 for a root."""
        parents = np.full(len(self.widths), -1)
        inner = np.flatnonzero(self.heights > self.widths)
        parents[inner] = self.of_columns(self.rows[self.row_at[inner] + self.widths[inner]])
        return parents


def trailing_block(factor: Any, n: int, leading: int) -> Real | None:
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
    held = held_factor(factor, n)
    if held is None:
        return None
    first, row_at, rows_of, value_at, values, order = Supernodes.of(held)
    if first[-1] != n or not (order[leading:] == np.arange(leading, n)).all():
        return None
    C = np.zeros((n - leading, n - leading), order="F")
    for k in range(int(np.searchsorted(first, leading, side="right")) - 1, held.nsuper):
        rows = rows_of[row_at[k] : row_at[k + 1]]
        columns = np.arange(first[k], first[k + 1])
        dense = values[value_at[k] : value_at[k] + len(rows) * len(columns)]
        dense = dense.reshape(len(columns), len(rows)).T
        top, left = np.searchsorted(rows, leading), np.searchsorted(columns, leading)
        block = slice(int(columns[left]) - leading, int(columns[-1]) + 1 - leading)
        below = rows[top:] - leading
        if len(below) == below[-1] + 1 - below[0]:
            C[below[0] : below[-1] + 1, block] = dense[top:, left:]
        else:
            C[below, block] = dense[top:, left:]
        # Entries above the diagonal of a supernode are undefined.
        C[block, block] = np.tril(C[block, block])
    return C


def factor_entries(factor: Any) -> int:
    """Return the number of entries of a supernodal factor; 0 for an unexpected structure."""
    held = held_factor(factor)
    return 0 if held is None else int(held.xsize)


def order_of(factor: Any, n: int) -> Indices | None:
    """Return the order of rows (n,) of a symbolic supernodal factor; None if it is unexpected."""
    held = held_factor(factor, n, numeric=False)
    if held is None:
        return None
    return np.array(_array(held.Perm, ctypes.c_int64, n))


def held_factor(
    factor: Any, n: int | None = None, *, numeric: bool = True
) -> FactorStructure | None:
    """Return the structure in a capsule; None if it is not as expected, or not of order n.

    Expected is a real supernodal factor L L^T with 64-bit indices, with numbers or without.
    """
    api = ctypes.pythonapi
    name_of, pointer_of = api.PyCapsule_GetName, api.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    if name_of(factor) != CAPSULE:
        return None
    held = ctypes.cast(pointer_of(factor, CAPSULE), ctypes.POINTER(FactorStructure)).contents
    flags = (held.is_ll, held.is_super, held.itype, held.xtype, held.dtype)
    sizes = 0 < held.nsuper <= held.n <= held.xsize and held.nsuper <= held.ssize
    whole = held.n == held.minor and n in (None, held.n)
    return held if flags == (1, 1, 2, int(numeric), 0) and sizes and whole else None


def _array(address: int, kind: Any, length: int) -> NDArray[Any]:
    """Return the array at an address, without a copy."""
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(kind)), (length,))
