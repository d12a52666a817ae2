"""Linear angle based flattening."""

from __future__ import annotations

import numpy as np

from cembench.conformal.free_boundary import is_strip, unrolled
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import algorithm

from .constraints import Angles, kept_positive, placed


@algorithm(
    "abf-linear",
    title="Linear ABF",
    target="free boundary",
    source="Zayer, Levy & Seidel, Linear angle based parameterization, 2007",
    usual=False,
)
def abf_linear(mesh: DiskMesh, *, repair: bool = True) -> Parameterization:
    """Find the flat triangulation with the angles nearest to the surface's, to first order.

    The relative changes of all angles are minimal in least squares, subject to the angle sums of
    triangles, pi, and of interior vertices, 2 pi, and to the logarithms of the wheels around
    interior vertices, all linearised at the surface's own angles, scaled to sum to 2 pi around each
    interior vertex. The triangles are eliminated, which leaves one symmetric solve with two
    unknowns per interior vertex. The vertices are then placed by least squares (LSCM with triangle
    shapes given by the angles, a second solve).

    Decided here: a step that would take an angle below a tenth of itself is shortened (`step` is
    the share taken). `triangle_residual`, `vertex_residual` (radians) and `wheel_residual` (of the
    logarithm) are what remains of the constraints, since the step is linear. Folds inside are
    repaired as in LSCM (`fold_repairs`).
    """
    return linear_angles(mesh, repair=repair)


def linear_angles(mesh: DiskMesh | HoledMesh, *, repair: bool = True) -> Parameterization:
    """Return the map of :func:`abf_linear`, with the boundaries of holes free too."""
    if isinstance(mesh, DiskMesh) and is_strip(mesh):
        return unrolled(mesh)
    problem = Angles(mesh)
    wanted = problem.wanted
    e, _ = problem.step(wanted, wanted**2, np.zeros_like(wanted))
    angles, share = kept_positive(wanted, e)
    return placed(mesh, angles, {**problem.told(angles), "step": share}, repair=repair)
