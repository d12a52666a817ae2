"""Sheets that are rectangles in isothermal coordinates: cylinder, Swiss roll, catenoid.

Each is conformal to a rectangle of known aspect, so :func:`exact_map` gives its conformal map to
the disk in closed form.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import scipy
from pydantic import Field

from cembench.core.arrays import Complex, Real
from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import MAX_FACES, surface_family

from .levers import with_levers
from .rectangle import rectangle_grid, rectangle_to_disk

Faces = Annotated[int, Field(ge=24, le=MAX_FACES)]


@surface_family("cylinder-sheet", title="Cylinder sheet", source="closed form")
@with_levers
def cylinder_sheet(
    faces: Faces = 20_000,
    *,
    angle: Annotated[float, Field(gt=0, lt=360)] = 270.0,
    height: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 2.0,
) -> DiskMesh:
    """Part of a cylinder of radius 1, `angle` degrees wide and of this `height`.

    It unrolls to a rectangle; :func:`exact_map` with aspect ``angle in radians / height`` is its
    conformal map to the disk.
    """
    aspect = np.deg2rad(angle) / height
    z, F = rectangle_grid(faces, aspect)
    turn = height * z.real
    V = np.stack([np.cos(turn), np.sin(turn), height * z.imag], axis=1)
    return DiskMesh.from_arrays(V, F, name="cylinder-sheet")


@surface_family("swiss-roll", title="Swiss roll", source="closed form")
@with_levers
def swiss_roll(
    faces: Faces = 20_000,
    *,
    turns: Annotated[float, Field(gt=0, le=10)] = 2.5,
    aspect: Annotated[float, Field(ge=0.25, le=16)] = 6.0,
) -> DiskMesh:
    """A rectangle of this `aspect` (length over width), rolled up along a spiral of arc length.

    It unrolls without stretching, so :func:`exact_map` with the same aspect is its conformal map.
    """
    z, F = rectangle_grid(faces, aspect)
    start = 1.5 * np.pi
    t = np.linspace(start, start + 2 * np.pi * turns, 200_001)
    # Arc length of r = t, scaled so that the whole spiral is as long as the rectangle.
    length = 0.5 * (t * np.sqrt(1 + t * t) + np.arcsinh(t))
    length -= length[0]
    scale = aspect / length[-1]
    at = scipy.interpolate.PchipInterpolator(scale * length, t)(
        np.clip(z.real, 0, scale * length[-1])
    )
    V = np.stack([scale * at * np.cos(at), scale * at * np.sin(at), z.imag], axis=1)
    return DiskMesh.from_arrays(V, F, name="swiss-roll")


@surface_family("catenoid-sheet", title="Catenoid sheet", source="closed form")
@with_levers
def catenoid_sheet(
    faces: Faces = 20_000,
    *,
    angle: Annotated[float, Field(gt=0, lt=360)] = 270.0,
    height: Annotated[float, Field(gt=0, le=6)] = 2.0,
) -> DiskMesh:
    """The catenoid of waist radius 1, `angle` degrees of it, between z = -height/2 and height/2.

    Its usual coordinates are isothermal: :func:`exact_map` with aspect ``angle in radians /
    height`` is its conformal map to the disk.
    """
    z, F = rectangle_grid(faces, np.deg2rad(angle) / height)
    u, v = height * z.real, height * (z.imag - 0.5)
    V = np.stack([np.cosh(v) * np.cos(u), np.cosh(v) * np.sin(u), v], axis=1)
    return DiskMesh.from_arrays(V, F, name="catenoid-sheet")


def ring_map(V: Real) -> Complex:
    """Return the conformal map of the catenoid ring to an annulus, its waist to the unit circle."""
    return np.exp(-V[:, 2] + 1j * np.arctan2(V[:, 1], V[:, 0]))


@surface_family("catenoid-ring", title="Catenoid", source="closed form", exact_map=ring_map)
@with_levers
def catenoid_ring(
    faces: Faces = 20_000, *, height: Annotated[float, Field(gt=0, le=6)] = 1.0
) -> HoledMesh:
    """The catenoid of waist radius 1 between z = -height/2 and height/2: a ring with one hole.

    Conformal to the annulus ``1 < |w| < exp(height)`` by :func:`ring_map`.
    """
    z, F = rectangle_grid(faces, 2 * np.pi / height)
    u, v = height * z.real, height * (z.imag - 0.5)
    rows = int(np.count_nonzero(z.real == 0))
    n = len(z) - rows  # the last column equals the first
    F = F % n
    V = np.stack([np.cosh(v) * np.cos(u), np.cosh(v) * np.sin(u), v], axis=1)[:n]
    return HoledMesh.from_arrays(V, F, name="catenoid-ring")


def exact_map(faces: int, aspect: float) -> Complex:
    """Return the conformal map to the disk of a sheet with this count and aspect, by vertex.

    Raises
    ------
    ParameterError
        The elliptic functions lose their digits at this aspect.
    """
    if not 0.2 <= aspect <= 20:
        raise ParameterError(
            f"aspect={aspect!r} is out of range: the exact map is accurate from 0.2 to 20. "
            "Choose other proportions."
        )
    return rectangle_to_disk(rectangle_grid(faces, aspect)[0], aspect)
