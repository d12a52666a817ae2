"""The columns of a factor that are passed by substitutions between a few rows.

If b is zero outside some rows, forward substitution begins at their columns and goes on only at the
ancestors of these in the elimination tree. The solution's entries at the same rows need no other
column for the substitution back. With the rows next to a surface's boundary that is a fifth of the
factor or less.

The part is a factor of its own to CHOLMOD, with the same numbers: of cvxopt's factor only its
supernodes' indices are copied.
"""

from __future__ import annotations

import ctypes
from typing import Any, Self

import numpy as np
from cvxopt import cholmod, matrix
from numpy.typing import NDArray

from cembench.linear_algebra.supernodes import (
    CAPSULE,
    FactorStructure,
    Supernodes,
    held_factor,
)

Real = NDArray[np.float64]
Indices = NDArray[np.int64]

# Codes of `cholmod.solve`: three of its steps.
_FORWARD, _BACKWARD, _PERMUTE_BACK = 4, 5, 8


class _Padded(ctypes.Structure):
    """A factor's structure, and zeros for what newer versions have behind it."""

    _fields_ = [("known", FactorStructure), ("newer", ctypes.c_char * 64)]


class FactorPart:
    """Substitutions between some rows, by the columns of the factor that they pass.

    Attributes
    ----------
    share : float
        The part's entries over those of the whole factor.

    """

    def __init__(self, factor: Any, whole: FactorStructure, nodes: Supernodes, rows: Indices):
        positions = np.empty(whole.n, dtype=np.int64)
        positions[nodes.order] = np.arange(whole.n)
        kept = _with_ancestors(nodes, positions[rows])
        widths, heights = nodes.widths[kept], nodes.heights[kept]
        self._columns = _ranges(nodes.first[kept], widths)
        self._at = np.searchsorted(self._columns, positions[rows])
        self._factor, self._whole = factor, whole
        below = nodes.rows[_ranges(nodes.row_at[kept], heights)]
        self._indices = {
            "super": np.append(0, widths.cumsum()),
            "pi": np.append(0, heights.cumsum()),
            "px": np.append(nodes.value_at[kept], 0),
            "s": np.searchsorted(self._columns, below),
        }
        self._own = _Padded(known=whole)
        mine = self._own.known
        mine.n = mine.minor = len(self._columns)
        mine.nsuper, mine.ssize = len(kept), len(below)
        for name, of_part in self._indices.items():
            setattr(mine, name, of_part.ctypes.data)
        new = ctypes.pythonapi.PyCapsule_New
        new.restype, new.argtypes = (
            ctypes.py_object,
            [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p],
        )
        self._part = new(ctypes.addressof(self._own), CAPSULE, None)
        self.share = float((widths * heights).sum() / whole.xsize)

    @classmethod
    def of(cls, factor: Any, n: int, rows: Indices) -> Self | None:
        """Return the part of a numeric factor of order n; None if its structure is not as expected.

        The numbers are the factor's own, also after it was computed anew.
        """
        whole = held_factor(factor, n)
        return None if whole is None else cls(factor, whole, Supernodes.of(whole), rows)

    def solve(self, B: Real) -> Real:
        """Return what X with A X = B is at the rows, for B (rows, k) there and 0 elsewhere."""
        x = self._forward(B)
        cholmod.solve(self._part, x, sys=_BACKWARD)
        return np.array(x)[self._at]

    def solve_everywhere(self, B: Real) -> Real:
        """Return all entries (n, k) of what :meth:`solve` finds."""
        padded = np.zeros((self._whole.n, B.shape[1]), order="F")
        padded[self._columns] = np.array(self._forward(B))
        x = matrix(padded)
        cholmod.solve(self._factor, x, sys=_BACKWARD)
        cholmod.solve(self._factor, x, sys=_PERMUTE_BACK)
        return np.array(x)

    def _forward(self, B: Real) -> matrix:
        self._own.known.x = self._whole.x  # it may have moved
        padded = np.zeros((len(self._columns), B.shape[1]), order="F")
        padded[self._at] = B
        x = matrix(padded)
        cholmod.solve(self._part, x, sys=_FORWARD)
        return x


def _with_ancestors(nodes: Supernodes, positions: Indices) -> Indices:
    """Return the supernodes of these columns and all their ancestors, in order."""
    parents = nodes.parents().tolist()
    reached = np.zeros(len(parents), dtype=bool)
    for node in np.unique(nodes.of_columns(positions)).tolist():
        while node >= 0 and not reached[node]:
            reached[node] = True
            node = parents[node]
    return np.flatnonzero(reached)


def _ranges(starts: Indices, lengths: Indices) -> Indices:
    """Return all start, start + 1, ..., start + length - 1, one range behind the other."""
    ends = lengths.cumsum()
    return np.repeat(starts - ends + lengths, lengths) + np.arange(ends[-1])
