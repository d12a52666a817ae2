"""The upper half of an ellipsoid."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

from .levers import with_levers
from .spherical_cap import spherical_cap


@surface_family("hemi-ellipsoid", title="Half ellipsoid", source="closed form")
@with_levers
def hemi_ellipsoid(
    faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 50_000,
    *,
    x: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.5,
    y: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0,
    z: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 2.0,
) -> DiskMesh:
    """The half z >= 0 of the ellipsoid with semi-axes x, y, z.

    No elementary formula for its conformal map is known; a fine triangulation is the reference for
    coarse ones.
    """
    hemisphere = spherical_cap(faces)
    V = hemisphere.V * np.array([x, y, z])
    return DiskMesh.from_arrays(V, hemisphere.F, name="hemi-ellipsoid")
