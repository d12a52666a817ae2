"""A cone with its tip: a power of the unrolled sector maps it conformally onto a disk."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.core.arrays import Complex, Real
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

from .disk_grid import disk_grid
from .levers import with_levers


def exact_map(V: Real, angle: float = 30.0) -> Complex:
    """Return the cone's conformal map to the unit disk: slant length ** (1 / sin(angle))."""
    slant = np.linalg.norm(V, axis=1)
    around = np.arctan2(V[:, 1], V[:, 0])
    return slant ** (1 / np.sin(np.deg2rad(angle))) * np.exp(1j * around)


@surface_family("cone", title="Cone", source="closed form", exact_map=exact_map)
@with_levers
def cone(
    faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 20_000,
    *,
    angle: Annotated[float, Field(gt=0, lt=90)] = 30.0,
) -> DiskMesh:
    """A round cone of slant length 1, with `angle` in degrees between its axis and its side.

    Its exact conformal map to the unit disk is :func:`exact_map`.
    """
    z, F = disk_grid(faces)
    tilt = np.deg2rad(angle)
    V = np.stack([np.sin(tilt) * z.real, np.sin(tilt) * z.imag, -np.cos(tilt) * np.abs(z)], axis=1)
    return DiskMesh.from_arrays(V, F, name="cone")
