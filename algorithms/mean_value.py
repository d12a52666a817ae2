"""Floater's map: convex combinations with mean value coordinates."""

from __future__ import annotations

import numpy as np

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.mean_value import convex_extension, mean_value_weights
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm


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
        W = mean_value_weights(mesh.V, mesh.F)
        z = np.zeros(mesh.n, dtype=np.complex128)
        z[b] = arc_length_circle(mesh)
    z = convex_extension(W, b, i, z)
    z, folds = accepted_repair(mesh, z, repair=repair)
    return Parameterization(z, extras=folds)
