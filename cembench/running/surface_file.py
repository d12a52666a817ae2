"""A surface in a file, made ready to be mapped, and its map written with what the file had."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.atlas import cut_map
from cembench.core.atomic import write_bytes
from cembench.core.errors import MeshError
from cembench.mesh.cut import Cut, cut_open
from cembench.mesh.defects import located
from cembench.mesh.files import checked, read_repaired, write_mesh
from cembench.mesh.obj_text import obj_text, with_uv
from cembench.mesh.reading import read_soup
from cembench.mesh.repair import Repaired
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
    if not cut:
        return SurfaceFile(path, read_mesh_for(path, algorithms, soup), repaired)
    uncut = checked(soup, TriangleMesh, path)
    try:
        found = cut_open(uncut)
    except MeshError as error:
        raise located(error, path) from None
    return SurfaceFile(path, found.mesh, repaired, uncut, found)


def check_map_format(output: Path, *, cut: bool) -> None:
    """Raise :class:`MeshError` where the map of a surface cannot be written to such a file."""
    if cut and output.suffix.lower() != ".obj":
        raise MeshError(
            f"{output}: the UVs of a cut surface belong to corners, not to vertices; allowed here: "
            ".obj. Write OBJ, or cut the surface with `cembench cut` and map the disk."
        )


def write_atlas(output: Path, surface: SurfaceFile, corners: NDArray[np.complex128]) -> None:
    """Write a surface with a UV for each corner (m, 3), as OBJ.

    Raises
    ------
    MeshError
        Another format, or the file cannot be written.

    """
    check_map_format(output, cut=True)
    found = cut_map(surface.mesh, corners)
    text = obj_text(surface.mesh.V, surface.mesh.F, found.uv, found.surface.F)
    write_bytes(output, text.encode("latin-1"), error=MeshError, parents=False)


def write_map(output: Path, surface: SurfaceFile, uv: NDArray[np.complex128]) -> None:
    """Write a surface with its map as UVs.

    An OBJ file that was not repaired keeps all that it had, and gets the UVs. A surface that was
    cut is written uncut, with a UV for each corner.

    Raises
    ------
    MeshError
        The file cannot be written.

    """
    cut, uncut = surface.cut, surface.uncut
    if output.suffix.lower() == ".obj" == surface.path.suffix.lower() and not surface.repaired:
        original = surface.path.read_text(encoding="latin-1")  # any bytes, as they are
        corners = (uncut.F, cut.mesh.F) if uncut and cut else ()
        text = with_uv(original, uv, *corners)
    elif uncut and cut:
        text = obj_text(uncut.V, uncut.F, uv, cut.mesh.F)
    else:
        write_mesh(output, surface.mesh, uv)
        return
    write_bytes(output, text.encode("latin-1"), error=MeshError, parents=False)
