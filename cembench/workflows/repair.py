"""Repair a mesh file or arrays into oriented manifolds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cembench.core.errors import MeshError
from cembench.core.notices import Notice
from cembench.mesh.defects import located
from cembench.mesh.files import read_soup
from cembench.mesh.repair import Components
from cembench.mesh.repair import repair as repair_arrays
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.running.surfaces import SurfaceInput, prepared, soup_of

#: Kinds of repaired surfaces; every one is of the first.
_KINDS: tuple[type[TriangleMesh], ...] = (TriangleMesh, DiskMesh, HoledMesh)


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
    notices: tuple[Notice, ...] = ()

    @property
    def mesh(self) -> TriangleMesh:
        """The surface with the most triangles."""
        return self.meshes[0]


def repair(
    surface: SurfaceInput,
    *,
    weld: float | None = None,
    fill_holes: int = 0,
    components: Components = "largest",
) -> Repair:
    """Repair a surface into an oriented manifold, and count every step.

    Parameters
    ----------
    surface : path, pair of arrays (V, F), or mesh
        V is (n, 3) and may hold NaN, F is (m, 3) and counts from 0.
    weld : float, optional
        Vertices up to this distance apart, in the surface's units, are merged; 0 merges only
        those that coincide exactly. By default these are merged unless the surface is a disk
        already, whose seams are cuts.
    fill_holes : int
        Boundary loops of at most this many edges are filled, except the longest of a component.
    components : "largest" or "all"
        The connected components to keep.

    Returns
    -------
    Repair
        ``.mesh`` is the surface, ``.meshes`` are all components, ``.steps`` counts what was done.

    Raises
    ------
    MeshError
        The file cannot be read, or no surface is left.
    ParameterError
        `weld` or `fill_holes` is negative, or `components` is neither "largest" nor "all".

    Examples
    --------
    A square of two triangles that do not share their vertices:

    >>> import cembench
    >>> V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> mended = cembench.repair((V, [[0, 1, 2], [3, 4, 5]]))
    >>> mended.mesh.n, mended.steps["vertices_welded"]
    (4, 2)
    >>> type(mended.mesh).__name__
    'DiskMesh'

    """
    path = Path(surface) if isinstance(surface, str | os.PathLike) else None
    soup = soup_of(surface) if path is None else read_soup(path)
    try:
        found = repair_arrays(
            soup.V, soup.polygons, weld=weld, fill_holes=fill_holes, components=components
        )
        soups = [Soup.of_triangles(V, F, name=soup.name) for V, F in found.surfaces]
        meshes = [prepared(one, _KINDS).mesh for one in soups]
    except MeshError as error:
        raise located(error, path) from None
    return Repair(tuple(meshes), found.counts, soup.notices)
