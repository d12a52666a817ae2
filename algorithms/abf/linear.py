"""Linear angle based flattening."""

from __future__ import annotations

import numpy as np

from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .constraints import Angles, kept_positive, placed


@algorithm(
    "abf-linear",
    title="Linear ABF",
    target="free boundary",
    source="Zayer, Levy & Seidel, Linear angle based parameterization, 2007",
    usual=False,
)
def abf_linear(mesh: DiskMesh) -> Parameterization:
    """Which angles of a flat triangulation are nearest to the surface's, to first order?

    The relative changes of all angles are least in squares, subject to the sums of triangles, pi,
    and of interior vertices, 2 pi, and to the logarithms of the wheels round interior vertices, all
    linear at the surface's own angles, scaled to 2 pi round each interior vertex. The triangles are
    eliminated; one symmetric solve with two unknowns an interior vertex is left. The vertices are
    then placed by least squares (LSCM with the shapes that the angles give, a second solve).

    Decided here: of a step that would take an angle below a tenth of itself only that share is
    taken (`step`). `triangle_residual`, `vertex_residual` (radians) and `wheel_residual` (of the
    logarithm) are what is left of the constraints, since a step is linear. Folds inside are mended
    as in LSCM (`fold_repairs`).
    """
    problem = Angles(mesh)
    wanted = problem.wanted
    e, _ = problem.step(wanted, wanted**2, np.zeros_like(wanted))
    angles, share = kept_positive(wanted, e)
    return placed(mesh, angles, {**problem.told(angles), "step": share})
