"""Repair a mesh file or arrays into oriented manifolds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cembench.api.settings import MAX_FACES
from cembench.core.arguments import Range, checked

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cembench.core.notices import Notice
    from cembench.mesh.repair import Kept
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.running.surfaces import SurfaceInput


@dataclass(frozen=True)
class Repair:
    """The result of a repair.

    Parameters
    ----------
    meshes : tuple of TriangleMesh
        The surfaces, the one with the most triangles first; each is a :class:`DiskMesh` or
        :class:`HoledMesh` if possible.
    steps : mapping of str to int
        How often each step was applied, by name, in the order of the steps.
    origins : tuple of pairs of int64 arrays
        For each surface the old number of each vertex (n,), and of the face (m,), triangle or
        polygon, that each triangle was part of; counted from 0, -1 for those that fill holes. Of
        vertices that were welded it is the first.
    kept : Kept
        The share of the area that is kept, and the numbers of triangles and pieces.
    notices : tuple of Notice
        What the reader of the file changed or ignored.

    Examples
    --------
    >>> import cembench
    >>> cembench.write_mesh("flat.obj", cembench.surface("flat-disk", 200))
    >>> len(cembench.repair("flat.obj").meshes)
    1
    """

    meshes: tuple[TriangleMesh, ...]
    steps: Mapping[str, int]
    origins: tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]
    kept: Kept
    notices: tuple[Notice, ...] = ()

    @property
    def mesh(self) -> TriangleMesh:
        """The surface with the most triangles."""
        return self.meshes[0]

    @property
    def vertices(self) -> NDArray[np.int64]:
        """The old number of each vertex of `mesh`, int64 (n,); -1 for new ones."""
        return self.origins[0][0]

    @property
    def faces(self) -> NDArray[np.int64]:
        """The old face of each triangle of `mesh`, int64 (m,); -1 for new ones."""
        return self.origins[0][1]


@checked
def repair(
    surface: SurfaceInput,
    *,
    weld: Annotated[float, Range(0.0, 1e60)] | None = None,
    fill_holes: Annotated[int, Range(0, MAX_FACES)] = 0,
    components: Literal["largest", "all"] = "largest",
    drop: bool = False,
) -> Repair:
    """Repair a surface into an oriented manifold, and count every step.

    Steps, in order: faces with missing vertices dropped, polygons cut into triangles, coincident
    vertices welded, degenerate and duplicate triangles fixed or dropped, sides divided at vertices
    that lie on them, non-manifold edges and vertices split, triangles oriented consistently,
    components chosen, ears dropped, holes filled, isolated vertices removed.
    docs/repair.md describes each step.

    A repair that would lose a piece, or more than 1 % of the area, fails, and names the option that
    keeps it.

    Parameters
    ----------
    surface : path, pair of arrays (V, F), or mesh
        V is (n, 3) and may hold NaN, F is (m, 3) and counts from 0.
    weld : float, optional
        Weld vertices up to this distance apart, in the surface's units; 0: equal ones only, which
        is the default but for a cut of a surface that can be mapped as it is.
    fill_holes : int
        Fill holes of at most N edges; the longest boundary loop of a component stays open.
    components : {"largest", "all"}
        Keep the component with the most triangles, or all of them.
    drop : bool
        Allow that pieces, or more than 1 % of the area, are lost.

    Returns
    -------
    Repair
        ``.mesh`` is the surface, ``.meshes`` are all components, ``.steps`` counts what was done,
        ``.vertices`` and ``.faces`` are the old numbers.

    Raises
    ------
    RepairLossError
        A piece or more than 1 % of the area would be lost, and `drop` is False.
    MeshError
        The file cannot be read, or no surface is left.
    ParameterError
        `weld` or `fill_holes` is negative, `weld` leaves nothing of the surface, or `components` is
        neither "largest" nor "all".

    Examples
    --------
    A square of two triangles that do not share their vertices:

    >>> import cembench
    >>> V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> mended = cembench.repair((V, [[0, 1, 2], [3, 4, 5]]))
    >>> mended.mesh.n, mended.steps["vertices_welded"]
    (4, 2)
    >>> mended.vertices.tolist()
    [0, 1, 2, 5]
    >>> type(mended.mesh).__name__
    'DiskMesh'
    """
    from cembench.mesh.defects import located
    from cembench.mesh.files import read_soup, repair_soup
    from cembench.mesh.soup import Soup
    from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
    from cembench.running.foreign_meshes import soup_of
    from cembench.running.surfaces import prepared

    path = Path(surface) if isinstance(surface, str | os.PathLike) else None
    soup = soup_of(surface) if path is None else read_soup(path)
    options = {"weld": weld, "fill_holes": fill_holes, "components": components, "drop": drop}
    repaired = repair_soup(soup, path, **options)
    kinds = (TriangleMesh, DiskMesh, HoledMesh)  # every surface is of the first
    soups = [Soup.of_triangles(V, F, name=soup.name) for V, F in repaired.surfaces]
    with located(path):
        meshes = tuple(prepared(one, kinds).mesh for one in soups)
    return Repair(meshes, repaired.counts, repaired.origins, repaired.kept, soup.notices)
