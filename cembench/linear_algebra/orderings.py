"""Options of CHOLMOD, and fill-reducing orderings of sparse symmetric matrices for it.

Approximate minimum degree (AMD) is cheap. Nested dissection (METIS) takes several times as long; on
large irregular meshes its factors are smaller, so it pays for many factorisations of one pattern,
or where memory is short. Dissection by position always costs as much as AMD on a regular grid, and
so pays where AMD is slower: on a grid whose diagonals run either way.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from cvxopt import amd, cholmod, matrix, spmatrix
from scipy import sparse

from cembench.core.arrays import Indices, Real
from cembench.linear_algebra.supernodes import order_of

#: Binary digits of a coordinate; the three together fit a double's 53.
DIGITS = 17


def set_options(*, postorder: bool) -> None:
    """Set all options of CHOLMOD that matter, as needed before each analysis and factorisation.

    cvxopt keeps them in one dictionary for the whole process.

    ``supernodal = 2`` also makes an indefinite matrix an error; without ``nmethods = 1`` a given
    permutation may be ignored. With `postorder` the given order is changed to the postorder of its
    elimination tree, which mixes a disconnected leading block with the rows after it.
    """
    cholmod.options["supernodal"] = 2
    cholmod.options["nmethods"] = 1
    cholmod.options["print"] = 0
    cholmod.options["postorder"] = postorder


def minimum_degree(lower: spmatrix) -> Indices:
    """Return the AMD ordering (n,) of the matrix with this lower triangle; it is a postorder."""
    return np.array(amd.order(lower)).ravel()


def nested_dissection(lower: spmatrix) -> Indices:
    """Return the METIS ordering (n,) of the matrix with this lower triangle, postordered."""
    import pymetis  # an extra

    starts, rows, _ = (np.array(part).ravel() for part in lower.CCS)
    ones = np.ones(len(rows), dtype=np.int8)
    below = sparse.csc_array((ones, rows, starts), shape=lower.size)
    strictly = sparse.tril(below, -1, format="csc")
    if not strictly.nnz:
        return np.arange(lower.size[0])
    graph = sparse.csr_array(strictly + strictly.T)
    whole = pymetis.CSRAdjacency(
        adj_starts=graph.indptr.astype(np.int32), adjacent=graph.indices.astype(np.int32)
    )
    order = np.empty(lower.size[0], dtype=np.int64)
    order[:] = pymetis.nested_dissection(whole)[0]  # of a type that cvxopt does not know
    return _postordered(lower, order)


def dissection_by_position(lower: spmatrix, points: Real) -> Indices:
    """Return a nested dissection (n,) of a matrix whose rows lie at points (n, 3) of a surface.

    Boxes are halved at their middles, x, y and z in turn. What of a box's lower half has a
    neighbour in the upper one separates the two, and comes after both. The order is not a postorder
    of the elimination tree.
    """
    starts, rows, _ = (np.array(part).ravel() for part in lower.CCS)
    columns = np.repeat(np.arange(len(points)), np.diff(starts))
    codes = _interleaved(points)
    first, second = codes[rows], codes[columns]
    _, halved = np.frexp((first ^ second).astype(np.float64))
    level = np.zeros(len(points), dtype=halved.dtype)
    np.maximum.at(level, np.where(first < second, rows, columns), halved)
    # The box that a row separates, or lies in, ends where its code with ones as last digits does.
    ends = codes | ((np.int64(1) << level) - 1)
    return np.argsort(ends << 6 | level, kind="stable")


def _interleaved(points: Real) -> Indices:
    """Return the position (n,) of points (n, 3) on a curve through boxes in boxes (Morton's)."""
    places = points - points.min(axis=0)
    places /= places.max() or 1.0
    x, y, z = _spread_digits().take((places * (2**DIGITS - 1)).astype(np.int64)).T
    return np.asarray(x | y << 1 | z << 2)


@cache
def _spread_digits() -> Indices:
    """Return each number of so many binary digits with these three places apart."""
    numbers = np.arange(2**DIGITS)
    spread = np.zeros_like(numbers)
    for digit in range(DIGITS):
        spread |= (numbers >> digit & 1) << 3 * digit
    return spread


def _postordered(lower: spmatrix, order: Indices) -> Indices:
    """Return the equivalent order by the postorder of the elimination tree."""
    set_options(postorder=True)
    postorder = order_of(cholmod.symbolic(lower, as_permutation(order)), len(order))
    return order if postorder is None else np.asarray(postorder, dtype=np.int64)


def as_permutation(order: Indices) -> matrix:
    """Return an ordering as cvxopt's functions take it."""
    return matrix(order, (len(order), 1), "i")
