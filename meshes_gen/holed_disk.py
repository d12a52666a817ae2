"""The flat unit disk with round holes, which is its own image for every method."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import scipy
from pydantic import Field

from cembench.core.arrays import Complex, Indices, Real
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import MAX_FACES, surface_family

from .levers import with_levers

#: Distance of interior points from the circles, in edge lengths.
CLEAR = 0.6
#: The golden angle between successive holes.
TURN = np.pi * (3 - np.sqrt(5))


@surface_family("holed-disk", title="Flat disk with holes", source="closed form")
@with_levers
def holed_disk(
    faces: Annotated[int, Field(ge=500, le=MAX_FACES)] = 20_000,
    *,
    holes: Annotated[int, Field(ge=1, le=60)] = 3,
    bend: Annotated[float, Field(ge=0, lt=0.5)] = 0.2,
) -> HoledMesh:
    """The unit disk with `holes` round holes on a spiral, warped by z + `bend` z^2.

    The warp is conformal, so the image is the disk with round holes, up to a Moebius map.
    """
    k = np.arange(holes)
    centres = 0.75 * np.sqrt((k + 0.5) / holes) * np.exp(1j * TURN * k)
    radii = np.full(holes, min(0.3, 0.33 / np.sqrt(holes)))
    V, F = disk_with_holes(centres, radii, faces)
    z = V[:, 0] + 1j * V[:, 1]
    warped = z + bend * z**2
    V = np.stack([warped.real, warped.imag, np.zeros(len(z))], axis=1)
    return HoledMesh.from_arrays(V, F, name="holed-disk")


def disk_with_holes(centres: Complex, radii: Real, faces: int) -> tuple[Real, Indices]:
    """Return V (n, 3) and F of the flat unit disk with round holes, with about `faces` triangles.

    A triangular lattice inside and evenly spaced points on the circles, in a Delaunay
    triangulation.
    """
    centres, radii = np.asarray(centres, dtype=complex), np.asarray(radii, dtype=float)
    h = np.sqrt(np.pi * (1 - (radii**2).sum()) * 4 / np.sqrt(3) / faces)
    z, rim = _points(centres, radii, h)
    F = scipy.spatial.Delaunay(np.stack([z.real, z.imag], axis=1)).simplices.astype(np.int64)
    # Triangles with all corners on one hole lie inside it.
    F = F[(rim[F] != rim[F[:, :1]]).any(axis=1) | (rim[F[:, 0]] <= 0)]
    areas = np.imag(np.conj(z[F[:, 1]] - z[F[:, 0]]) * (z[F[:, 2]] - z[F[:, 0]]))
    F = np.where((areas > 0)[:, None], F, F[:, ::-1])
    return np.stack([z.real, z.imag, np.zeros(len(z))], axis=1), F


def _points(centres: Complex, radii: Real, h: float) -> tuple[Complex, Indices]:
    """Return points (n,) and their circles: 0 for the unit circle, k for a hole, -1 for none."""
    circles, rim = [], []
    for k, (c, r) in enumerate([(0j, 1.0), *zip(centres, radii, strict=True)]):
        count = max(12, round(2 * np.pi * r / h))
        circles.append(c + r * np.exp(2j * np.pi * np.arange(count) / count))
        rim += [k] * count
    n = int(2 / h) + 2
    a, b = np.meshgrid(np.arange(-2 * n, 2 * n), np.arange(-n, n))
    inside = (h * (a + b / 2 + 0.5j * np.sqrt(3) * b)).ravel()
    inside = inside[np.abs(inside) < 1 - CLEAR * h]
    for c, r in zip(centres, radii, strict=True):
        inside = inside[np.abs(inside - c) > r + CLEAR * h]
    return np.concatenate([*circles, inside]), np.array(rim + [-1] * len(inside))
