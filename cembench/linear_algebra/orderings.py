"""Options of CHOLMOD, and fill-reducing orderings of sparse symmetric matrices for it.

Approximate minimum degree (AMD) is cheap. Nested dissection (METIS) takes several times as long; on
large irregular meshes its factors are smaller, so it pays for many factorisations of one pattern,
or where memory is short.
"""

from __future__ import annotations

import numpy as np
from cvxopt import amd, cholmod, matrix, spmatrix
from numpy.typing import NDArray
from scipy import sparse

from cembench.linear_algebra.supernodes import order_of


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


def minimum_degree(lower: spmatrix) -> NDArray[np.int64]:
    """Return the AMD ordering (n,) of the matrix with this lower triangle; it is a postorder."""
    return np.array(amd.order(lower)).ravel()


def nested_dissection(lower: spmatrix) -> NDArray[np.int64]:
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


def _postordered(lower: spmatrix, order: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the equivalent order by the postorder of the elimination tree."""
    set_options(postorder=True)
    postorder = order_of(cholmod.symbolic(lower, as_permutation(order)), len(order))
    return order if postorder is None else np.asarray(postorder, dtype=np.int64)


def as_permutation(order: NDArray[np.int64]) -> matrix:
    """Return an ordering as cvxopt's functions take it."""
    return matrix(order, (len(order), 1), "i")
