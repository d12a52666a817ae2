"""Boundary first flattening, by its authors' command line program."""

from __future__ import annotations

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import external_program

_SOURCE = "Sawhney & Crane 2017, https://github.com/GeometryCollective/boundary-first-flattening"
_REMEDY = (
    "Build `bff-command-line` of https://github.com/GeometryCollective/boundary-first-flattening "
    "and put its folder into PATH"
)


@external_program(
    "bff-program",
    title="BFF",
    target="free boundary",
    command="bff-command-line {input} {output} --scaling=1e6",
    source=_SOURCE,
    remedy=_REMEDY,
)
def bff(mesh: DiskMesh) -> None:
    """Map a disk by boundary first flattening with a free boundary.

    The program writes six decimals, so its image is scaled by a million.
    """


@external_program(
    "bff-program-disk",
    title="BFF to the disk",
    target="disk",
    command="bff-command-line {input} {output} --flattenToDisk --scaling=1e6",
    source=_SOURCE,
    remedy=_REMEDY,
    circle=1e-3,
    fit=True,
)
def bff_disk(mesh: DiskMesh) -> None:
    """Map a disk by boundary first flattening with the disk as target.

    The program sets the curvature of the boundary and closes the curve: it lies within about 1e-3
    of a circle, which is fitted.
    """
