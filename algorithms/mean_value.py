"""Floater's map: convex combinations with mean value coordinates."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.laplacian import corner_products
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.work import count_analysis, count_columns, count_factorisation
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

Real = NDArray[np.float64]


@algorithm(
    "mean-value",
    title="Mean value",
    target="disk",
    source="Floater, Mean value coordinates, 2003; the CEM paper, Remark 5",
    usual=False,
    conformal=False,
)
def mean_value(mesh: DiskMesh, *, repair: bool = True) -> Parameterization:
    """Map a disk by mean value weights, which use the geometry and are always positive.

    As harmonic-circle, with the weight (tan(a / 2) + tan(b / 2)) / l_ij from i to j, a and b the
    angles at i on either side of that edge. The weights are positive, so that only triangles with
    all corners on the boundary can fold, and they reproduce flat surfaces exactly. They are not
    symmetric, so the map does not minimise an energy. The boundary keeps its arc length.

    Decided here: the matrix is not symmetric, so the shared Cholesky class cannot factor it;
    SuperLU factors it with an ordering for symmetric patterns. Folds are repaired as in LSCM
    (`fold_repairs`).
    """
    if not len(mesh.interior):
        raise AlgorithmFailed("the mesh has no interior vertex, so the map has no unknowns")
    i, b = mesh.interior, mesh.boundary
    with phase("laplacian"):
        W = _weights(mesh)
    with phase("assembly"):
        rows = W[i]
        A = scipy.sparse.csc_array(scipy.sparse.diags_array(rows.sum(axis=1)) - rows[:, i])
        z = np.zeros(mesh.n, dtype=np.complex128)
        z[b] = arc_length_circle(mesh)
        right = rows[:, b] @ z[b]
    with phase("factorisation"):
        factor = _factored(A)
    count_analysis()
    count_factorisation(A.shape[0], lambda: int(factor.nnz))
    count_columns(2)
    with phase("solves"):
        z[i] = factor.solve(right.real) + 1j * factor.solve(right.imag)
    z, folds = accepted_repair(mesh, z, repair=repair)
    return Parameterization(z, extras=folds)


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


def _weights(mesh: DiskMesh) -> scipy.sparse.csr_array:
    """Return the mean value weights (n, n) from i to j."""
    F = mesh.F
    dots, double_area = corner_products(mesh.V, F)
    after, before = F[:, [1, 2, 0]], F[:, [2, 0, 1]]
    to_after = np.linalg.norm(mesh.V[after] - mesh.V[F], axis=2)
    to_before = np.linalg.norm(mesh.V[before] - mesh.V[F], axis=2)
    # tan(a / 2) = sin a / (1 + cos a) = (1 - cos a) / sin a, multiplied by the sides' lengths; the
    # second form for angles above 90 degrees, to avoid cancellation.
    sides, sine = to_after * to_before, double_area[:, None]
    tangent = np.where(dots > 0, sine, sides - dots) / np.where(dots > 0, sides + dots, sine)
    i = np.concatenate([F.ravel(), F.ravel()])
    j = np.concatenate([after.ravel(), before.ravel()])
    w = np.concatenate([(tangent / to_after).ravel(), (tangent / to_before).ravel()])
    return scipy.sparse.csr_array(scipy.sparse.coo_array((w, (i, j)), shape=(mesh.n, mesh.n)))
