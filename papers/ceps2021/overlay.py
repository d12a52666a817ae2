"""The map of cetm-flips on the common refinement, as an algorithm that a run measures."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cembench.conformal.last_resort import valid_map
from cembench.conformal.metrics import angle_errors, flipped_triangles, is_disk_map
from cembench.conformal.planar import turns
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm, load_registry


@algorithm(
    "cetm-flips-overlay",
    title="CETM, flips, on the refinement",
    target="disk",
    source="Gillespie, Springborn & Crane 2021",
    usual=False,
)
def cetm_flips_overlay(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-9,
    max_iterations: Annotated[int, Field(ge=1, le=10_000)] = 200,
) -> Parameterization:
    """Map to the disk by cetm-flips, and judge that map on the common refinement.

    A cell of a run has one image for each vertex of its surface. So the refinement's own figures
    are numbers beside it: `overlay_valid` (1 for a homeomorphism onto the disk), `overlay_folded`
    before its repair, `overlay_triangles`, and `overlay_angle_mean` in degrees. The images of the
    surface's own vertices are the map of the cell, made valid as for cetm-flips. Its seconds are
    those of both. `parameterize(surface, "cetm-flips", overlay=True)` returns the refinement.
    """
    from cembench.running.measure import refinement_of  # what measures, loaded where it is used

    refined_map = refinement_of(load_registry().algorithm("cetm-flips"))
    refined = refined_map(mesh, tolerance=tolerance, max_iterations=max_iterations)
    fine, image, numbers = refined.mesh, refined.uv, refined.extras
    uv, repairs = valid_map(mesh, image[: mesh.n])
    folds = flipped_triangles(fine, image)
    once = turns(image[fine.boundary])[0] == 1
    return Parameterization(
        uv,
        extras={
            **repairs,
            "curvature": numbers["curvature"],
            "flips": numbers["flips"],
            "overlay_valid": float(not folds and is_disk_map(fine, image) and once),
            "overlay_folded": numbers["folded_before_repair"],
            "overlay_triangles": fine.m,
            "overlay_angle_mean": float(angle_errors(fine, image).mean()),
        },
    )
