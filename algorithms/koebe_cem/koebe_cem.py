"""CEM for surfaces with holes: Koebe's method (the paper's Algorithm 2)."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from cembench.conformal.metrics import boundary_circularity
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import algorithm

from .steps import Patches, Weights, finished, koebe_steps, shown_steps


@algorithm(
    "koebe-cem",
    title="Koebe-CEM",
    target="circular holes",
    source="The CEM paper, Algorithm 2; Zeng et al. 2009",
    steps=shown_steps,
)
def koebe_cem(
    mesh: HoledMesh,
    *,
    sweeps: Annotated[int, Field(ge=1, le=1_000)] = 1,
    outer: Annotated[int, Field(ge=0, lt=2**63)] | None = None,
    tolerance: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 1e-5,
    max_iterations: Annotated[int, Field(ge=0, le=1_000_000)] = 20,
    inversion: bool = True,
    patches: Patches = "disks",
    weights: Weights = "surface",
    rounding: bool = True,
    repair: bool = True,
) -> Parameterization:
    """Map a surface with holes to a disk with round holes by Algorithm 2 of the paper.

    One sweep is Algorithm 2: each boundary in turn is left open, the others are filled, and CEM
    makes it a circle; the outer boundary (that of the vertex `outer`, or the widest) comes last.
    Further sweeps continue from there. Since patches change only dense blocks at the boundary, the
    interior is eliminated once, for all steps of all sweeps.

    Decided here: the surface's own triangles keep the surface's cotangent weights in every step
    (`weights="plane"` takes those of the last image, as the paper's text reads). A hole that has an
    image is filled by a round disk with its vertices at their images (`patches="fans"`: by a fan to
    the centroid, as in the paper, which ignores the disk's interior). The holes are sorted longest
    first, and the shortest is opened first. A step starts from the paper's pole (in later sweeps
    from the boundary's position when it was last open) or from the boundary's last image put on a
    circle, whichever has the lower E_C, and ends when E_C changes by less than `tolerance` (CEM's
    `stop="change"`). At the end each hole is put on the circle fitted to it and
    the interior is solved for again (`rounding`; `circularity_before_rounding` is its circularity
    before that).
    """
    steps = list(
        koebe_steps(
            mesh,
            sweeps=sweeps,
            outer=outer,
            patches=patches,
            weights=weights,
            tolerance=tolerance,
            max_iterations=max_iterations,
            inversion=inversion,
        )
    )
    iterations = [len(step.energies) - 1 for step in steps]
    uv, folds = finished(mesh, steps[-1], outer=outer, rounding=rounding, repair=repair)
    extras: dict[str, Any] = {
        "iterations_by_step": iterations,
        "order_kept": sum(step.order_kept for step in steps),
        "circularity_before_rounding": boundary_circularity(mesh, steps[-1].uv),
        **folds,
    }
    return Parameterization(uv, sum(iterations), (), extras)
