"""The columns of a factor that are passed by substitutions between a few rows.

If b is zero outside some rows, forward substitution begins at their columns and goes on only at the
ancestors of these in the elimination tree. The solution's entries at the same rows need no other
column for the substitution back. With the rows next to a surface's boundary that is a third of the
factor.

The part is a factor of its own to CHOLMOD, with the same numbers: of cvxopt's factor only its
supernodes' indices are copied. No version of CHOLMOD promises to take such a factor, so a process
first solves a known system by it. If that goes wrong there are no parts, and the whole is passed.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any, Self

import numpy as np
from cvxopt import cholmod, matrix, spmatrix

from cembench.core.arrays import Indices, Real
from cembench.linear_algebra.orderings import as_permutation, minimum_degree, set_options
from cembench.linear_algebra.supernodes import CAPSULE, FactorStructure, Supernodes, held_factor

# Codes of `cholmod.solve`: three of its steps.
_FORWARD, _BACKWARD, _PERMUTE_BACK = 4, 5, 8


class _Padded(ctypes.Structure):
    """A factor's structure, and zeros for what newer versions have behind it."""

    _fields_ = [("known", FactorStructure), ("newer", ctypes.c_char * 64)]


class FactorTree:
    """The elimination tree of a numeric factor, of which parts can be taken.

    The numbers are the factor's own, also after it was computed anew.
    """

    def __init__(self, factor: Any, whole: FactorStructure) -> None:
        self.factor, self.whole, self.nodes = factor, whole, Supernodes.of(whole)
        #: The column of the factor at each row of the matrix.
        self.positions = np.empty(whole.n, dtype=np.int64)
        self.positions[self.nodes.order] = np.arange(whole.n)
        self._parents = self.nodes.parents().tolist()

    @classmethod
    def of(cls, factor: Any, n: int) -> Self | None:
        """Return the tree of a factor of order n; None if parts of it cannot be trusted."""
        whole = held_factor(factor, n)
        return cls(factor, whole) if whole is not None and parts_are_right() else None

    def with_ancestors(self, rows: Indices) -> Indices:
        """Return the supernodes of these rows and all their ancestors, in order."""
        reached = np.zeros(len(self._parents), dtype=bool)
        for node in np.unique(self.nodes.of_columns(self.positions[rows])).tolist():
            while node >= 0 and not reached[node]:
                reached[node] = True
                node = self._parents[node]
        return np.flatnonzero(reached)


class FactorPart:
    """Substitutions between some rows, by the columns of the factor that they pass.

    Attributes
    ----------
    columns : int64
        The columns of the factor that the part has.
    at : int64 (rows,)
        Where the rows are among these columns.
    share : float
        The part's entries over those of the whole factor.
    """

    def __init__(self, tree: FactorTree, rows: Indices) -> None:
        self._tree, nodes = tree, tree.nodes
        supernodes = tree.with_ancestors(rows)
        widths, heights = nodes.widths[supernodes], nodes.heights[supernodes]
        self.columns = _ranges(nodes.first[supernodes], widths)
        self.at = np.searchsorted(self.columns, tree.positions[rows])
        below = nodes.rows[_ranges(nodes.row_at[supernodes], heights)]
        self._indices = {
            "super": np.append(0, widths.cumsum()),
            "pi": np.append(0, heights.cumsum()),
            "px": np.append(nodes.value_at[supernodes], 0),
            "s": np.searchsorted(self.columns, below),
        }
        self._own = _Padded(known=tree.whole)
        mine = self._own.known
        mine.n = mine.minor = len(self.columns)
        mine.nsuper, mine.ssize = len(supernodes), len(below)
        for name, of_part in self._indices.items():
            setattr(mine, name, of_part.ctypes.data)
        new = ctypes.pythonapi.PyCapsule_New
        new.restype = ctypes.py_object
        new.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
        self._part = new(ctypes.addressof(self._own), CAPSULE, None)
        self.share = float((widths * heights).sum() / tree.whole.xsize)

    def solve(self, B: Real) -> Real:
        """Return what X with A X = B is at the rows, for B (rows, k) there and 0 elsewhere."""
        return self.backward(self.forward(B))[self.at]

    def solve_everywhere(self, B: Real) -> Real:
        """Return all entries (n, k) of what :meth:`solve` finds."""
        x = matrix(0.0, (self._tree.whole.n, B.shape[1]))
        np.asarray(x)[self.columns] = self.forward(B)
        cholmod.solve(self._tree.factor, x, sys=_BACKWARD)
        cholmod.solve(self._tree.factor, x, sys=_PERMUTE_BACK)
        return np.asarray(x)

    def forward(self, B: Real) -> Real:
        """Return Y with L Y = B on the part, for B (rows, k) at the rows and 0 elsewhere."""
        x = matrix(0.0, (len(self.columns), B.shape[1]))
        np.asarray(x)[self.at] = B
        return self._substituted(x, _FORWARD)

    def backward(self, Y: Real) -> Real:
        """Return X with L^T X = Y on the part, which needs nothing of the rest."""
        return self._substituted(matrix(Y), _BACKWARD)

    def _substituted(self, x: matrix, step: int) -> Real:
        """Solve in place, and return the numbers without a copy."""
        self._own.known.x = self._tree.whole.x  # it may have moved
        cholmod.solve(self._part, x, sys=step)
        return np.asarray(x)


@cache
def parts_are_right() -> bool:
    """Whether a part solves a known system as it should, tried once in a process.

    The system is the Laplacian of a grid, with a boundary at which it is zero.
    """
    side = 8
    line = 2 * np.eye(side) - np.eye(side, k=1) - np.eye(side, k=-1)
    A = np.kron(line, np.eye(side)) + np.kron(np.eye(side), line)
    rows, columns = np.nonzero(np.tril(A))
    lower = spmatrix(A[rows, columns], rows, columns, A.shape, "d")
    set_options(postorder=True)
    factor = cholmod.symbolic(lower, as_permutation(minimum_degree(lower)))
    cholmod.numeric(lower, factor)
    whole = held_factor(factor, len(A))
    if whole is None:
        return False
    some = np.arange(side)
    part = FactorPart(FactorTree(factor, whole), some)
    B = np.zeros((len(A), 2))
    B[some] = np.stack([np.ones(side), np.sin(some)], axis=1)
    X = np.linalg.solve(A, B)
    return np.allclose(part.solve(B[some]), X[some]) and np.allclose(
        part.solve_everywhere(B[some]), X
    )


def _ranges(starts: Indices, lengths: Indices) -> Indices:
    """Return all start, start + 1, ..., start + length - 1, one range behind the other."""
    ends = lengths.cumsum()
    return np.repeat(starts - ends + lengths, lengths) + np.arange(lengths.sum())
