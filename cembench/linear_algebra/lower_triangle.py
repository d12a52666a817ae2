"""Lower triangles of symmetric matrices, all that a Cholesky factorisation reads."""

from __future__ import annotations

import numpy as np
import scipy

from cembench.core.arrays import Indices


def permuted_lower(A: scipy.sparse.csr_array, order: Indices) -> scipy.sparse.csc_array:
    """Return the lower triangle of ``A[order][:, order]``, in one pass over A.

    Parameters
    ----------
    A : sparse (n, n)
        Symmetric, by rows.
    order : int64 (k,)
        Which rows and columns, each once; k may be less than n.

    Returns
    -------
    lower : sparse (k, k)
        By columns, each from top to bottom.

    Examples
    --------
    >>> A = scipy.sparse.csr_array([[4.0, 1.0, 2.0], [1.0, 5.0, 0.0], [2.0, 0.0, 6.0]])
    >>> permuted_lower(A, np.array([2, 0])).toarray()
    array([[6., 0.],
           [2., 4.]])
    """
    k = len(order)
    rows = A[order]
    kind = rows.indices.dtype
    place = np.full(A.shape[0], k, dtype=kind)
    place[order] = np.arange(k, dtype=kind)
    columns = place.take(rows.indices)
    in_triangle = columns <= np.repeat(np.arange(k, dtype=kind), np.diff(rows.indptr))
    before = np.zeros(rows.nnz + 1, dtype=kind)
    np.cumsum(in_triangle, out=before[1:])
    kept = np.flatnonzero(in_triangle)
    lower = scipy.sparse.csr_array(
        (rows.data.take(kept), columns.take(kept), before.take(rows.indptr)), shape=(k, k)
    ).tocsc()
    # Turning rows into columns takes them one after the other.
    lower.has_sorted_indices = True
    return lower


def both_triangles(lower: scipy.sparse.csc_array) -> scipy.sparse.csc_array:
    """Return the symmetric matrix with this lower triangle."""
    return scipy.sparse.csc_array(lower + scipy.sparse.tril(lower, -1).T)
