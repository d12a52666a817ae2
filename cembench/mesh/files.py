"""Mesh files: OBJ, OFF, PLY (ASCII and binary) and STL, read and written through libraries.

MATLAB files (MAT, before version 7.3) are read too: variables v (n, 3), and f (m, 3) from 1.

Reading keeps every vertex, in the file's order and in float64, and only the geometry: texture
seams of an OBJ do not cut the surface. Polygons are cut into triangles by fans, with a notice.
"""

from __future__ import annotations

import io
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import igl
import meshio
import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.io import loadmat

from cembench.core.errors import MeshError
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Arrays = tuple[NDArray[np.float64], NDArray[np.int64], tuple[str, ...]]
M = TypeVar("M", bound=TriangleMesh)


def read_mesh(path: str | os.PathLike[str], mesh_type: type[M] = DiskMesh) -> M:  # type: ignore[assignment]
    """Which checked surface does this file hold? Its name is the file's stem.

    Raises
    ------
    MeshError
        The file is missing, empty, of unknown format or damaged, or its mesh fails a check.

    """
    path = Path(path)
    try:
        V, F, notices = read_arrays(path)
        return mesh_type.from_arrays(V, F, name=path.stem, notices=notices)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def is_mesh_file(path: Path) -> bool:
    """Is this a file whose name says that it can be read as a mesh?"""
    return path.is_file() and path.suffix.lower() in _READERS


def read_arrays(path: Path) -> Arrays:
    """What vertices (n, 3), triangles (m, 3) and notices does this file give, unchecked?

    Raises
    ------
    MeshError
        The file is missing, empty, of unknown format or damaged.

    """
    if not path.is_file():
        what = "this is a folder, not a file" if path.is_dir() else "there is no such file"
        raise MeshError(f"{what}. Check the path; paths are relative to {Path.cwd()}.")
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise MeshError(
            f"unknown mesh format {path.suffix!r}; allowed: {', '.join(_READERS)}. "
            "Convert the file to one of these."
        )
    if path.stat().st_size == 0:
        raise MeshError("the file is empty (0 bytes). Export or download it again.")
    try:
        V, F, notices = read(path)
    except MeshError:
        raise
    except Exception as error:  # the libraries raise anything on a damaged file
        detail = str(error).strip() or type(error).__name__
        raise MeshError(
            f"the file cannot be read as {path.suffix[1:].upper()} ({detail}). It is damaged, cut "
            "short, or of another format than its name says; export it again."
        ) from error
    if len(F) == 0:
        raise MeshError(
            f"no faces: {len(V)} vertices were found, but not one triangle or polygon. The file "
            "holds a point cloud, was cut short, or is of another format than its name says."
        )
    return V, F, notices


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


def _read_obj(path: Path) -> Arrays:
    text = path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    # Positions alone: the library refuses texture coordinates that are not one a vertex.
    kept = [line for line in map(str.lstrip, text.splitlines()) if line[:2] in ("v ", "f ")]
    faces_begin = next((k for k, line in enumerate(kept) if line[0] == "f"), len(kept))
    vertices_end = max((k for k, line in enumerate(kept) if line[0] == "v"), default=-1)
    found = meshio.obj.read(io.StringIO(re.sub(r"/\S*", "", "\n".join(kept))))
    V, F, notices = _from_meshio(found)
    relative = F < -1  # the library subtracts 1 from what the file counts from 1, or back from -1
    if relative.any():
        if vertices_end > faces_begin:
            raise MeshError(
                "relative (negative) face indices between the vertices are not supported. "
                "Export it with absolute indices."
            )
        F = np.where(relative, F + 1 + len(V), F)
    return V, F, notices


def _read_ply(path: Path) -> Arrays:
    return _from_meshio(meshio.ply.read(path))


def _read_stl(path: Path) -> Arrays:
    with np.errstate(over="ignore"):  # of the triangle count that an ASCII file seems to hold
        return _from_meshio(meshio.stl.read(path))


def _from_meshio(found: meshio.Mesh) -> Arrays:
    points = np.asarray(found.points, dtype=np.float64)
    V = points[:, :3] if points.ndim == 2 else points.reshape(0, 3)
    blocks = [
        np.asarray(block.data, dtype=np.int64)
        for block in found.cells
        if block.type in ("triangle", "quad", "polygon") and block.data.shape[1] >= 3
    ]
    F = np.concatenate([_fans(block) for block in blocks]) if blocks else np.empty((0, 3), int)
    polygons = sum(len(block) for block in blocks if block.shape[1] > 3)
    return V, F, _polygon_notice(polygons)


def _fans(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles of polygons that all have the same number of corners, (k, c) -> (k (c - 2), 3)."""
    c = polygons.shape[1]
    corners = np.stack([np.zeros(c - 2, int), np.arange(1, c - 1), np.arange(2, c)], axis=1)
    return polygons[:, corners].reshape(-1, 3)


def _polygon_notice(polygons: int) -> tuple[str, ...]:
    return (f"{polygons} polygons were cut into triangles",) if polygons else ()


def _read_off(path: Path) -> Arrays:
    found = trimesh.load_mesh(path, process=False)
    words = re.sub(r"#.*", "", path.read_text()).split()
    declared = int(words[2])
    if len(found.faces) < declared:
        raise MeshError(
            f"{declared} faces are declared but {len(found.faces)} were found. It was cut short."
        )
    cut = f"polygons were cut: {declared} faces became {len(found.faces)} triangles"
    notice = (cut,) if len(found.faces) > declared else ()
    return np.asarray(found.vertices, float), np.asarray(found.faces, np.int64), notice


def _read_mat(path: Path) -> Arrays:
    try:
        content = loadmat(path)
    except NotImplementedError:
        raise MeshError(
            "MATLAB files of version 7.3 are not supported. In MATLAB, save it with "
            "save(..., '-v7')."
        ) from None
    missing = [name for name in ("v", "f") if name not in content]
    if missing:
        present = ", ".join(name for name in content if not name.startswith("__")) or "none"
        raise MeshError(
            f"no variable {missing[0]!r}; it has: {present}. Needed are v (n, 3), the vertices, "
            "and f (m, 3), the triangles counted from 1."
        )
    F = np.asarray(content["f"])
    if not np.issubdtype(F.dtype, np.number) or (np.round(F) != F).any() or F.min(initial=1) < 1:
        raise MeshError("variable 'f' must hold whole numbers from 1 on, the triangles' corners.")
    return np.asarray(content["v"], dtype=np.float64), F.astype(np.int64) - 1, ()


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


_READERS: dict[str, Callable[[Path], Arrays]] = {
    ".obj": _read_obj,
    ".off": _read_off,
    ".ply": _read_ply,
    ".stl": _read_stl,
    ".mat": _read_mat,
}
_WRITERS: dict[str, Callable[[Path, TriangleMesh, ArrayLike | None], None]] = {
    ".obj": _write_obj,
    ".off": _write_off,
    ".ply": _write_ply,
    ".stl": _write_stl,
}
_WITH_UV = (".obj", ".ply")
