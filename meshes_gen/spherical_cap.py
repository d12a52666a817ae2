"""A spherical cap: stereographic projection maps it conformally onto a round disk."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.core.arrays import Complex, Real
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

from .disk_grid import disk_grid
from .levers import with_levers


def exact_map(V: Real, angle: float = 90.0) -> Complex:
    """Return the cap's conformal map to the unit disk: stereographic from the south pole."""
    return (V[:, 0] + 1j * V[:, 1]) / (1 + V[:, 2]) / np.tan(np.deg2rad(angle) / 2)


@surface_family("spherical-cap", title="Spherical cap", source="closed form", exact_map=exact_map)
@with_levers
def spherical_cap(
    faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 20_000,
    *,
    angle: Annotated[float, Field(gt=0, lt=180)] = 90.0,
) -> DiskMesh:
    """The part of the unit sphere within `angle` degrees of the north pole; 90 is a hemisphere.

    Its exact conformal map to the unit disk is :func:`exact_map`, up to a Moebius map of the disk.
    """
    z, F = disk_grid(faces)
    polar = np.abs(z) * np.deg2rad(angle)
    direction = np.divide(z, np.abs(z), out=np.ones_like(z), where=z != 0)
    V = np.stack(
        [np.sin(polar) * direction.real, np.sin(polar) * direction.imag, np.cos(polar)], axis=1
    )
    return DiskMesh.from_arrays(V, F, name="spherical-cap")
