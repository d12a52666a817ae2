"""Tutte's map: every interior vertex is the mean of its neighbours."""

from __future__ import annotations

import numpy as np

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian_of_weights
from cembench.core.clock import phase
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm


@algorithm(
    "harmonic-tutte",
    title="Tutte",
    target="disk",
    source="Tutte, How to draw a graph, 1963; the CEM paper, Remark 5",
    usual=False,
    conformal=False,
)
def harmonic_tutte(mesh: DiskMesh, *, repair: bool = True) -> Parameterization:
    """Map a disk by one Dirichlet solve that uses the graph of the mesh but not its geometry.

    As harmonic-circle, with the weight 1 on every edge instead of cotangents (the paper's Remark 5
    allows any positive weights). The boundary keeps its arc length. The only triangles that can
    fold are those with all corners on the boundary (`fold_repairs`).
    """
    with phase("laplacian"):
        # An interior edge counts from both of its triangles.
        L = laplacian_of_weights(mesh.F, np.full(mesh.F.shape, 0.5), mesh.n)
    z = harmonic_extension(L, mesh.boundary, arc_length_circle(mesh))
    z, folds = accepted_repair(mesh, z, L, repair=repair)
    return Parameterization(z, extras=folds)
