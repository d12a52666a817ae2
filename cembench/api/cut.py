"""Cut surfaces that are not disks, such as closed ones or ones with handles, into disks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cembench.core.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cembench.mesh.cut import Cut
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.running.surfaces import SurfaceInput


def cut(
    surface: SurfaceInput,
    *,
    through: Sequence[int] = (),
    along: Sequence[Sequence[int]] | Literal["uv"] | None = None,
) -> Cut:
    """Cut a surface open along short curves, or along given seams, until it is a disk.

    A closed surface without handles is cut between two points far from each other, a surface with
    handles along a short cut graph; holes are joined to the cut.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A connected surface, closed or with boundary loops, of any genus.
    through : sequence of int
        Vertices that the cut must reach, counted from 0. By default, a sphere is cut between two
        points far from each other.
    along : sequence of sequences of int, or "uv", optional
        Seams: vertices, counted from 0, with the shortest paths between two that are not
        neighbours. "uv": where the texture coordinates of the file (OBJ, OFF, PLY, MAT, NPZ) have
        seams. If these leave more than a disk, it is cut further; if they divide the surface, the
        result has several pieces.

    Returns
    -------
    Cut
        ``.mesh`` is the disk, with the surface's triangles in their order; ``.origin``, int64
        (k,), is the vertex of the surface that each vertex of the disk is a copy of; ``.edges``
        and ``.length`` describe the cut.

    Raises
    ------
    MeshError
        The surface is damaged or not connected.
    ParameterError
        A vertex does not exist, on a sphere only two neighbouring vertices are given, both
        `through` and `along` are given, or there are no UVs.

    Examples
    --------
    >>> import cembench
    >>> V = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    >>> F = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> octahedron = cembench.cut((V, F), through=[2, 5])
    >>> octahedron.mesh.n, len(octahedron.mesh.boundary), len(octahedron.edges)
    (7, 4, 2)
    """
    from cembench.mesh.cut import cut_along, cut_open, edges_of_paths, edges_of_uv_seams
    from cembench.mesh.defects import located
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.running.surfaces import load_surface

    if along is not None and len(through):
        raise ParameterError("`along` and `through` exclude each other; give one of them.")
    mesh = load_surface(surface, (TriangleMesh,))
    path = Path(surface) if isinstance(surface, str | os.PathLike) else None
    with located(path):
        if along is None:
            return cut_open(mesh, through)
        if isinstance(along, str):
            return cut_along(mesh, edges_of_uv_seams(mesh, _uv_of(path, along, mesh)))
        return cut_along(mesh, edges_of_paths(mesh, along))


def _uv_of(path: Path | None, along: str, mesh: TriangleMesh) -> NDArray[np.complex128]:
    """Return the texture coordinates of a file at the corners of its triangles, (m, 3)."""
    from cembench.mesh.uvs import read_uv, uv_of_corners

    if along != "uv" or path is None or not path.is_file():
        raise ParameterError(
            f"along={along!r} is not allowed; allowed are lists of vertices and, for a file with "
            "texture coordinates, 'uv'."
        )
    return uv_of_corners(read_uv(path), mesh.V, mesh.F)
