"""Boundary first flattening with a free boundary, or to a polygon."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from cembench.conformal.boundary_curve import closed_curve
from cembench.conformal.free_boundary import is_strip, unrolled, with_area_pi
from cembench.core.arrays import Real
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .yamabe import YamabeBoundary


def _check_number_of_corners(corners: int) -> int:
    """Refuse polygons with one or two corners."""
    if corners in (1, 2):
        raise ValueError("a polygon has at least 3 corners; 0 leaves the boundary free")
    return corners


@algorithm(
    "bff-free",
    title="BFF, free",
    target="free boundary",
    source="Sawhney & Crane, Boundary first flattening, 2017",
    usual=False,
)
def bff_free(
    mesh: DiskMesh,
    *,
    corners: Annotated[int, Field(ge=0, le=1_000), AfterValidator(_check_number_of_corners)] = 0,
    delaunay: bool = False,
    repair: bool = True,
) -> Parameterization:
    """Flatten with the boundary at its own scale, or to a polygon.

    By default u = 0 on the boundary, the automatic flattening of the paper: the exterior angles
    k - L_bi L_ii^-1 Omega follow, and the boundary keeps its lengths, so that areas change least
    there. With `corners` the boundary turns by 2 pi / corners at this many vertices, evenly spaced
    along it, and nowhere else; u follows up to its mean, and the sides follow from u.

    Decided here: the curve is closed by the smallest change of its lengths (`closing` is the
    largest relative change), the interior is the harmonic extension of both coordinates with the
    one factorisation, and the image is scaled to area pi. `gauss_bonnet` is the distance of the sum
    of the exterior angles from 2 pi. A boundary that crosses itself is left as it is, and the
    harness reports it. Folds inside are repaired as in LSCM (`fold_repairs`).
    """
    if is_strip(mesh) and not corners:
        return unrolled(mesh)
    yamabe = YamabeBoundary(mesh, delaunay=delaunay)
    turns, lengths = yamabe.natural, yamabe.lengths
    if corners:
        turns = _corners(yamabe.lengths, corners)
        lengths = yamabe.scaled(yamabe.scale(turns))
    z, closing = closed_curve(lengths, turns)
    uv, folds = with_area_pi(mesh, yamabe.bordered.harmonic_extension(z), repair=repair)
    extras = {"closing": closing, "gauss_bonnet": abs(float(turns.sum()) - 2 * np.pi)}
    return Parameterization(uv, extras={**extras, **folds})


def _corners(lengths: Real, corners: int) -> Real:
    """Return exterior angles (B,) of a polygon, corners evenly spaced from the longest edge."""
    first = int(np.argmax(lengths))
    along = np.cumsum(np.roll(lengths, -first)) / lengths.sum()
    at = np.searchsorted(along, np.arange(corners) / corners, side="right")
    turns = np.bincount(at % len(lengths), minlength=len(lengths)) * (2 * np.pi / corners)
    return np.roll(turns, first)
