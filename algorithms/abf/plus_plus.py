"""Angle based flattening by Newton's method."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.free_boundary import is_strip, unrolled
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .constraints import Angles, kept_positive, placed

#: Minimal curvature of the Lagrangian at a corner, as a share of that of its error.
MIN_CURVATURE = 0.3


@algorithm(
    "abf++",
    title="ABF++",
    target="free boundary",
    source="Sheffer, Levy, Mogilnitsky & Bogomyakov, ABF++, 2005",
    usual=False,
)
def abf_plus_plus(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-8,
    max_iterations: Annotated[int, Field(ge=1, le=10_000)] = 50,
    repair: bool = True,
) -> Parameterization:
    """Find the flat triangulation with the angles nearest to the surface's.

    Minimise the sum of (angle - wanted)^2 / wanted^2, subject to the angle sums of triangles, pi,
    and of interior vertices, 2 pi, and to the wheels around interior vertices, by Newton's method
    on the Lagrangian. Its Hessian is diagonal. Eliminating it and the triangles leaves one
    symmetric solve per step, with two unknowns per interior vertex and one analysed pattern. The
    vertices are then placed by least squares, as in abf-linear.

    Decided here: wheels are taken as logarithms, which keeps their second derivatives diagonal;
    these are limited so that every entry of the Hessian stays above 0.3 of the error's own; a step
    is cut if an angle would fall below a tenth of itself. The iteration ends when all constraints,
    in radians and logarithms, are within `tolerance` (`triangle_residual`, `vertex_residual`,
    `wheel_residual`) and the last step changed no angle by more than 1e-4 of itself, and fails
    after `max_iterations`. Folds inside are repaired as in LSCM (`fold_repairs`).
    """
    if is_strip(mesh):
        return unrolled(mesh)
    problem = Angles(mesh)
    wanted = problem.wanted
    angles, weight = wanted.copy(), 1 / wanted**2
    y_w = np.zeros(problem.k)
    number = problem.number[mesh.F]
    for iteration in range(1, max_iterations + 1):
        at = np.where(number >= 0, y_w[number], 0.0)
        # A corner is next to one corner of its triangle and before the other.
        bent = (np.roll(at, 1, axis=1) - np.roll(at, -1, axis=1)) / np.sin(angles) ** 2
        curvature = np.maximum(weight + bent, MIN_CURVATURE * weight)
        e, y_w = problem.step(angles, 1 / curvature, weight * (angles - wanted))
        angles, share = kept_positive(angles, e)
        extras = problem.told(angles)
        moved = float(np.abs(share * e / angles).max())
        if share == 1 and max(extras.values()) <= tolerance and moved <= 1e-4:
            return placed(mesh, angles, extras, repair=repair, iterations=iteration)
    raise AlgorithmFailed(
        f"the angles have not converged after {max_iterations} Newton steps: the constraints are "
        f"still off by up to {max(extras.values()):.2g}, tolerance {tolerance:g}, and the last "
        f"step changed an angle by a relative {moved:.2g}. Allow more with max_iterations"
    )
