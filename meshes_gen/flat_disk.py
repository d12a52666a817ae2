"""The flat unit disk, optionally stretched; all of its conformal maps are known."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

from .disk_grid import disk_grid
from .levers import with_levers


@surface_family("flat-disk", title="Flat disk", source="closed form")
@with_levers
def flat_disk(
    faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 5_000,
    *,
    stretch: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0,
) -> DiskMesh:
    """The unit disk in the plane z = 0, stretched along x into an ellipse.

    With ``stretch=1`` the conformal maps to the disk are the Moebius maps of the disk itself.
    """
    z, F = disk_grid(faces)
    V = np.stack([stretch * z.real, z.imag, np.zeros(len(z))], axis=1)
    return DiskMesh.from_arrays(V, F, name="flat-disk")
