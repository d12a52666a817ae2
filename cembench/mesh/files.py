"""Mesh files read as checked surfaces, and surfaces and maps written as OBJ, OFF, PLY and STL.

Polygons are cut into triangles by fans, with a notice.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import igl
import meshio
import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from cembench.core.errors import MeshError
from cembench.mesh.reading import READERS as _READERS
from cembench.mesh.reading import read_soup
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

M = TypeVar("M", bound=TriangleMesh)


def read_mesh(path: str | os.PathLike[str], mesh_type: type[M] = DiskMesh) -> M:  # type: ignore[assignment]
    """Read a file as a checked surface, which is named after the file's stem.

    Raises
    ------
    MeshError
        The file is missing, empty, of unknown format or damaged, or its mesh fails a check.

    """
    soup = read_soup(path)
    try:
        return checked(soup, mesh_type)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def checked(soup: Soup, mesh_type: type[M]) -> M:
    """Check polygons as a surface of this kind, cut into triangles.

    Raises
    ------
    MeshError
        A check fails.

    """
    polygons = int((soup.sizes > 3).sum())
    cut = (f"{polygons} polygons were cut into triangles",) if polygons else ()
    return mesh_type.from_arrays(soup.V, soup.triangles, name=soup.name, notices=soup.notices + cut)


def write_mesh(
    path: str | os.PathLike[str], mesh: TriangleMesh, uv: NDArray[np.complex128] | None = None
) -> None:
    """Write the surface, and the map as its texture coordinates, in full precision.

    The file appears whole or not at all. UVs have 17 significant digits (OBJ) or are float64 (PLY):
    with fewer, triangles fold where the map shrinks the surface. They are the map itself, not
    moved into the unit square.

    Raises
    ------
    MeshError
        Unknown format, one that cannot hold UVs (OFF, STL), or a folder that cannot be written.

    """
    path = Path(path)
    check_writable_format(path, with_uv=uv is not None)
    UV = None if uv is None else np.stack([uv.real, uv.imag], axis=1)
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".cembench-") as folder:
            draft = Path(folder) / f"draft{path.suffix.lower()}"
            _WRITERS[path.suffix.lower()](draft, mesh, UV)
            draft.replace(path)
    except OSError as error:
        raise MeshError(
            f"{path} cannot be written: {error.strerror or error}. Choose another place."
        ) from error


def check_writable_format(path: Path, *, with_uv: bool) -> None:
    """Raise :class:`MeshError` where :func:`write_mesh` could not write a file of this name."""
    suffix = path.suffix.lower()
    allowed = _WITH_UV if with_uv else tuple(_WRITERS)
    if suffix not in allowed:
        readable = "can be read but not written" if suffix in _READERS else "is unknown"
        why = "cannot hold texture coordinates" if suffix in _WRITERS else readable
        raise MeshError(
            f"{path}: mesh format {suffix!r} {why}; allowed here: {', '.join(allowed)}."
        )
    if not path.parent.is_dir():
        raise MeshError(f"{path}: there is no folder {path.parent}. Make it first.")


def _write_obj(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    nothing, none = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    if UV is None:
        igl.writeOBJ(path, mesh.V, mesh.F)
    else:
        igl.writeOBJ(path, mesh.V, mesh.F, nothing, none, UV, mesh.F)


def _write_ply(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    extra = {} if UV is None else {"UV": UV}
    igl.writePLY(path, mesh.V.copy(), mesh.F.copy(), **extra)


def _write_off(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    # trimesh would write a fixed number of digits behind the point.
    meshio.off.write(path, meshio.Mesh(mesh.V, [("triangle", mesh.F)]))


def _write_stl(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    trimesh.Trimesh(mesh.V, mesh.F, process=False).export(path)


_WRITERS: dict[str, Callable[[Path, TriangleMesh, ArrayLike | None], None]] = {
    ".obj": _write_obj,
    ".off": _write_off,
    ".ply": _write_ply,
    ".stl": _write_stl,
}
_WITH_UV = (".obj", ".ply")
