"""Functions of a :class:`cembench.Result`, which entry points of ``cembench.result`` name."""

from __future__ import annotations

from pathlib import Path

from cembench.api.parameterize import Result
from cembench.api.settings import AnyPath
from cembench.core.arrays import Real
from cembench.mesh.soup import columns
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.mesh.unit_square import to_unit_square

from . import resample
from .resample import Side


def geometry_image(result: Result, side: Side = 257) -> Real:
    """Return the surface sampled on a regular grid of the map.

    Parameters
    ----------
    result : Result
        The map.
    side : int
        Samples along a side.

    Returns
    -------
    float64 (side, side, 3)
        Points of the surface. A map onto the disk is sampled on the square, any other in place, see
        :func:`cembench.textures.resample.geometry_image`.
    """
    onto_disk = resample.off_the_circle(result.mesh, result.z) <= resample.ON_CIRCLE
    grid: resample.Grid = "square" if onto_disk else "disk"
    return resample.geometry_image(result.mesh, result.z, side, grid)


def remesh(result: Result, side: Side = 65) -> DiskMesh:
    """Return the surface remeshed with triangles that are equilateral in the disk.

    Parameters
    ----------
    result : Result
        The map.
    side : int
        Lattice points along the disk's diameter; see
        :func:`cembench.textures.resample.regular_remesh`.

    Returns
    -------
    DiskMesh
        The new mesh.
    """
    return resample.regular_remesh(result.mesh, result.z, side)[0]


def bake(result: Result, texture: AnyPath, source: AnyPath) -> bytes:
    """Return a texture of the surface's own UVs, repainted for those that `save` writes.

    Parameters
    ----------
    result : Result
        The map.
    texture : path
        The picture.
    source : path
        The OBJ file that the surface was read from, whose UVs the picture is made for.

    Returns
    -------
    bytes
        A PNG file.

    Raises
    ------
    RenderError
        The picture cannot be read.
    MeshError
        The file is not OBJ, has no UVs, or other faces.
    """
    from .bake import baked_png, read_texture, uv_of_faces

    old, F = uv_of_faces(Path(source), result.mesh.F), result.mesh.F
    return baked_png(read_texture(Path(texture)), old, columns(to_unit_square(result.z))[F])
