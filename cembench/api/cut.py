"""Cut surfaces that are not disks, such as closed ones or ones with handles, into disks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.core.errors import MeshError

if TYPE_CHECKING:
    from cembench.mesh.cut import Cut
    from cembench.running.surfaces import SurfaceInput


def cut(surface: SurfaceInput, *, through: Sequence[int] = ()) -> Cut:
    """Cut a surface open along short curves until it is a disk.

    A closed surface without handles is cut between two points far from each other, a surface with
    handles along a short cut graph; holes are joined to the cut.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A connected surface, closed or with boundary loops, of any genus.
    through : sequence of int
        Vertices that the cut must reach, counted from 0. By default, a sphere is cut between two
        points far from each other.

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
        A vertex does not exist, or on a sphere only two neighbouring vertices are given.

    Examples
    --------
    >>> import cembench
    >>> V = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    >>> F = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> octahedron = cembench.cut((V, F), through=[2, 5])
    >>> octahedron.mesh.n, len(octahedron.mesh.boundary), len(octahedron.edges)
    (7, 4, 2)

    """
    from cembench.mesh.cut import cut_open
    from cembench.mesh.defects import located
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.running.surfaces import load_surface

    mesh = load_surface(surface, (TriangleMesh,))
    try:
        return cut_open(mesh, through)
    except MeshError as error:
        path = Path(surface) if isinstance(surface, str | os.PathLike) else None
        raise located(error, path) from None
