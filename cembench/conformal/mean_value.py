"""Mean value weights: positive, so that maps onto convex polygons do not fold (Floater 2003)."""

from __future__ import annotations

import numpy as np
import scipy

from cembench.conformal.laplacian import corner_products
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.work import count_analysis, count_columns, count_factorisation


def mean_value_weights(V: Real, F: Indices) -> scipy.sparse.csr_array:
    """Return the mean value weights (n, n) from i to j, (tan(a / 2) + tan(b / 2)) / l_ij.

    V (n, 3), F (m, 3); a and b are the angles at i on either side of the edge.
    """
    dots, double_area = corner_products(V, F)
    after, before = F[:, [1, 2, 0]], F[:, [2, 0, 1]]
    to_after = np.linalg.norm(V[after] - V[F], axis=2)
    to_before = np.linalg.norm(V[before] - V[F], axis=2)
    # tan(a / 2) = sin a / (1 + cos a) = (1 - cos a) / sin a, multiplied by the sides' lengths; the
    # second form for angles above 90 degrees, to avoid cancellation.
    sides, sine = to_after * to_before, double_area[:, None]
    tangent = np.where(dots > 0, sine, sides - dots) / np.where(dots > 0, sides + dots, sine)
    i = np.concatenate([F.ravel(), F.ravel()])
    j = np.concatenate([after.ravel(), before.ravel()])
    w = np.concatenate([(tangent / to_after).ravel(), (tangent / to_before).ravel()])
    return scipy.sparse.csr_array(scipy.sparse.coo_array((w, (i, j)), shape=(len(V), len(V))))


def convex_extension(
    W: scipy.sparse.csr_array, fixed: Indices, free: Indices, z: Complex
) -> Complex:
    """Return the map (n,) whose free vertices are means of their neighbours with weights W (n, n).

    The rows of free vertices have entries at free and fixed vertices only; `z` (n,) has the images
    of the fixed ones. W is not symmetric, so the shared Cholesky class cannot factor it; SuperLU
    does, with an ordering for symmetric patterns.

    Raises
    ------
    AlgorithmFailed
        The matrix cannot be factored: triangles are too thin.
    """
    with phase("assembly"):
        rows = W[free]
        A = scipy.sparse.csc_array(scipy.sparse.diags_array(rows.sum(axis=1)) - rows[:, free])
        right = rows[:, fixed] @ z[fixed]
    with phase("factorisation"):
        factor = _factored(A)
    count_analysis()
    count_factorisation(A.shape[0], lambda: int(factor.nnz))
    count_columns(2)
    z = z.copy()
    with phase("solves"):
        z[free] = factor.solve(right.real) + 1j * factor.solve(right.imag)
    return z


def _factored(A: scipy.sparse.csc_array) -> scipy.sparse.linalg.SuperLU:
    """Factor the matrix of mean value weights."""
    try:
        return scipy.sparse.linalg.splu(
            A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:  # the only error of SuperLU
        raise AlgorithmFailed(
            "the matrix of mean value weights cannot be factored: the mesh has triangles that "
            "are too thin"
        ) from error
