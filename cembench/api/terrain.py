"""A surface of heights on a grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh


def terrain(
    z: ArrayLike, x: ArrayLike | None = None, y: ArrayLike | None = None
) -> DiskMesh | HoledMesh:
    """Return the surface of heights on a grid.

    Parameters
    ----------
    z : float (rows, columns)
        Heights; NaN, or what a mask hides, leaves a hole. With an xarray's DataArray, x and y are
        its coordinates, unless they are given.
    x, y : float, optional
        The positions of the columns and of the rows, in the unit of the heights: one number for
        each, an array of the shape of z, or the distance of neighbours (default: 1).

    Returns
    -------
    DiskMesh or HoledMesh
        The grid's cells, each cut into two triangles that face up. Grid points in no cell are left
        out.

    Raises
    ------
    MeshError
        The shapes do not fit, or the finite heights do not form a single surface.

    Examples
    --------
    >>> import cembench, numpy as np
    >>> z = np.array([[0, 1, 0], [1, 2, 1], [0, 1, 0]])
    >>> hill = cembench.terrain(z, x=30.0, y=30.0)
    >>> hill.n, hill.m, hill.V[-1].tolist()
    (9, 8, [60.0, 60.0, 0.0])
    """
    from cembench.mesh.files import most_special
    from cembench.mesh.terrain import heights_of, soup_of_heights
    from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh

    if x is None and y is None and (labelled := heights_of(z)) is not None:
        z, x, y = labelled
    kinds: tuple[Any, ...] = (DiskMesh, HoledMesh)
    mesh: DiskMesh | HoledMesh = most_special(soup_of_heights(z, x, y), kinds)
    return mesh
