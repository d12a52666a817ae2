"""Read mesh files as checked surfaces, and write surfaces and maps to files.

Polygons are cut into triangles, with a notice.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes
from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.defects import located
from cembench.mesh.reading import READERS as _READERS
from cembench.mesh.reading import read_soup
from cembench.mesh.repair import Repaired, repair
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.mesh.writers.glb import glb_bytes
from cembench.mesh.writers.npz import npz_bytes
from cembench.mesh.writers.obj import obj_bytes
from cembench.mesh.writers.off import off_bytes
from cembench.mesh.writers.ply import ply_bytes
from cembench.mesh.writers.stl import stl_bytes
from cembench.mesh.writers.textured import Textured
from cembench.mesh.writers.vtp import vtp_bytes

M = TypeVar("M", bound=TriangleMesh)


def read_mesh(
    path: str | os.PathLike[str],
    mesh_type: type[M] = DiskMesh,  # type: ignore[assignment]
    *,
    arrays: tuple[str, str] | None = None,
    polygons: tuple[int, int] | None = None,
) -> M:
    """Read a file as a checked surface, named after the file's stem.

    Parameters
    ----------
    path : path
        OBJ, OFF, PLY, STL, MAT or NPZ; with the extra "formats" also VTK, VTU, GLB, GLTF and GII.
    mesh_type : type
        The required class: `DiskMesh`, `HoledMesh`, or `TriangleMesh` for any surface.
    arrays : tuple of two str, optional
        For MAT and NPZ files: the names of the vertices and of the triangles (default: found
        automatically).
    polygons : tuple of two int, optional
        The first and the last polygon to read, counted from 0 (default: all). Vertices of other
        polygons are dropped.

    Returns
    -------
    DiskMesh, HoledMesh or TriangleMesh
        The surface, of the class `mesh_type`.

    Raises
    ------
    MeshError
        The file is missing, empty, damaged or of unknown format, or its mesh fails a check.

    Examples
    --------
    >>> import cembench
    >>> cembench.write_mesh("disk.obj", cembench.surface("flat-disk", 600))
    >>> mesh = cembench.read_mesh("disk.obj")
    >>> mesh.name, mesh.m
    ('disk', 600)

    """
    return checked(read_soup(path, arrays=arrays, polygons=polygons), mesh_type, Path(path))


def read_repaired(path: Path) -> tuple[Soup, Repaired]:
    """Read a file and repair it; return the largest surface in it and a summary of the repair.

    Raises
    ------
    MeshError
        The file cannot be read, or nothing is left of its mesh.

    """
    soup = read_soup(path)
    try:
        repaired = repair(soup.V, soup.polygons)
    except MeshError as error:
        raise located(error, path) from None
    V, F = repaired.surfaces[0]
    notices = soup.notices + repaired.notices
    return Soup(V, F.ravel(), np.full(len(F), 3), soup.name, notices), repaired


def checked(soup: Soup, mesh_type: type[M], path: Path) -> M:
    """Cut the polygons of a file into triangles and check them as a surface of this class.

    Raises
    ------
    MeshError
        A check fails.

    """
    polygons = int((soup.sizes > 3).sum())
    notices = soup.notices
    if polygons:
        told = f"{polygons} polygons were cut into triangles"
        notices += (Notice(NoticeKind.POLYGONS_CUT, told),)
    try:
        return mesh_type.from_arrays(soup.V, soup.triangles, name=soup.name, notices=notices)
    except MeshError as error:
        raise located(error, path) from None
    except MemoryError as error:
        raise MeshError(
            f"{path}: memory does not suffice to check {len(soup.V):,} vertices and "
            f"{len(soup.sizes):,} polygons. Use a machine with more, or a smaller surface."
        ) from error


def write_mesh(
    path: str | os.PathLike[str], mesh: TriangleMesh, uv: NDArray[np.complex128] | None = None
) -> None:
    """Write a surface, with a map as its texture coordinates if one is given.

    The file is written completely or not at all. OBJ, VTP and NPZ hold texture coordinates in full
    precision; PLY and GLB in single precision, as their readers expect, so that triangles fold
    where the map shrinks the surface strongly.

    Parameters
    ----------
    path : path
        OBJ, PLY, GLB, VTP or NPZ; without a map also OFF and STL.
    mesh : TriangleMesh
        The surface.
    uv : complex128 (n,), optional
        Image of each vertex, written unchanged. :func:`cembench.mesh.unit_square.to_unit_square`
        moves it to the unit square, where engines expect textures.

    Raises
    ------
    MeshError
        The format is unknown or cannot hold UVs (OFF, STL), or the folder cannot be written to.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> cembench.write_mesh("disk_uv.obj", disk, disk.V[:, 0] + 1j * disk.V[:, 1])

    """
    UV = None if uv is None else np.stack([uv.real, uv.imag], axis=1)
    write_textured(Path(path), Textured(mesh.V, mesh.F, UV, name=mesh.name))


def write_textured(path: Path, surface: Textured) -> None:
    """Write a surface with its texture coordinates; as :func:`write_mesh`."""
    check_writable_format(path, with_uv=surface.uv is not None)
    content = _WRITERS[path.suffix.lower()](surface)
    write_bytes(path, content, error=MeshError, parents=False)


def check_writable_format(path: Path, *, with_uv: bool) -> None:
    """Raise :class:`MeshError` if :func:`write_mesh` cannot write a file of this name."""
    suffix = path.suffix.lower()
    allowed = WITH_UV if with_uv else tuple(_WRITERS)
    if suffix not in allowed:
        readable = "can be read but not written" if suffix in _READERS else "is unknown"
        why = "cannot hold texture coordinates" if suffix in _WRITERS else readable
        raise MeshError(
            f"{path}: mesh format {suffix!r} {why}; allowed here: {', '.join(allowed)}."
        )
    if not path.parent.is_dir():
        raise MeshError(f"{path}: there is no folder {path.parent}. Make it first.")


_WRITERS: dict[str, Callable[[Textured], bytes]] = {
    ".obj": obj_bytes,
    ".ply": ply_bytes,
    ".glb": glb_bytes,
    ".vtp": vtp_bytes,
    ".npz": npz_bytes,
    ".off": off_bytes,
    ".stl": stl_bytes,
}
#: Formats that hold texture coordinates.
WITH_UV = (".obj", ".ply", ".glb", ".vtp", ".npz")
#: Those that hold texture coordinates in single precision.
SINGLE = (".ply", ".glb")
