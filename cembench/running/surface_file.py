"""A surface in a file, made ready to be mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cembench.core.errors import MeshError
from cembench.mesh.cut import Cut, cut_open
from cembench.mesh.defects import located
from cembench.mesh.files import checked, read_repaired
from cembench.mesh.reading import read_soup
from cembench.mesh.repair import Repaired
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.running.plan import read_mesh_for


@dataclass(frozen=True)
class SurfaceFile:
    """A surface that was read from a file, and what was done to it before it is mapped."""

    path: Path
    #: What is mapped: the surface of the file, mended and cut open if that was wanted.
    mesh: TriangleMesh
    repaired: Repaired | None = None
    #: The surface before it was cut, and the cut.
    uncut: TriangleMesh | None = None
    cut: Cut | None = None


def read_surface_file(
    path: Path, algorithms: Sequence[Algorithm], *, mend: bool = False, cut: bool = False
) -> SurfaceFile:
    """Read a surface as the kind that the algorithms take, mended and cut open if wanted.

    What is cut open is a disk, whatever they take.

    Raises
    ------
    MeshError
        The file cannot be read, or its surface is not of that kind.

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
    """Check what a file holds, as :func:`read_surface_file` does."""
    if not cut:
        return SurfaceFile(path, read_mesh_for(path, algorithms, soup), repaired)
    uncut = checked(soup, TriangleMesh, path)
    try:
        found = cut_open(uncut)
    except MeshError as error:
        raise located(error, path) from None
    return SurfaceFile(path, found.mesh, repaired, uncut, found)
