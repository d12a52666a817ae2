"""Read a surface from a file, and prepare it for mapping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cembench.core.errors import MeshError
from cembench.mesh.cut import Cut, cut_open
from cembench.mesh.defects import located
from cembench.mesh.files import checked, read_repaired, read_soup
from cembench.mesh.repair import Repaired
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.running.plan import read_mesh_for


@dataclass(frozen=True)
class SurfaceFile:
    """A surface read from a file, with its repair and its cut."""

    path: Path
    #: The surface to map: that of the file, repaired and cut open if requested.
    mesh: TriangleMesh
    repaired: Repaired | None = None
    #: The surface before it was cut, and the cut.
    uncut: TriangleMesh | None = None
    cut: Cut | None = None


def read_surface_file(
    path: Path, algorithms: Sequence[Algorithm], *, mend: bool = False, cut: bool = False
) -> SurfaceFile:
    """Read a surface as a kind that the algorithms take, repaired and cut open if requested.

    A surface that is cut open is always read as a disk.

    Raises
    ------
    MeshError
        The file cannot be read, or its surface is not of such a kind.

    """
    soup, repaired = read_repaired(path) if mend else (read_soup(path), None)
    return surface_of_soup(path, soup, algorithms, repaired, cut=cut)


def surface_of_soup(
    path: Path,
    soup: Soup,
    algorithms: Sequence[Algorithm],
    repaired: Repaired | None = None,
    *,
    cut: bool = False,
) -> SurfaceFile:
    """Check the content of a file, like :func:`read_surface_file`."""
    if not cut:
        return SurfaceFile(path, read_mesh_for(path, algorithms, soup), repaired)
    uncut = checked(soup, TriangleMesh, path)
    try:
        found = cut_open(uncut)
    except MeshError as error:
        raise located(error, path) from None
    return SurfaceFile(path, found.mesh, repaired, uncut, found)
