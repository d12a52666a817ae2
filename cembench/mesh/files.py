"""Mesh files read as checked surfaces, and surfaces and maps written as OBJ, OFF, PLY and STL.

Polygons are cut into triangles by fans, with a notice.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.atomic import write_by
from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.defects import located
from cembench.mesh.obj_text import obj_text
from cembench.mesh.off_reader import read_off
from cembench.mesh.reading import READERS as _READERS
from cembench.mesh.reading import read_soup
from cembench.mesh.repair import Repaired, repair
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Writer = Callable[[Path, TriangleMesh, ArrayLike | None], None]
#: From a file that was written, and its mesh, to the arrays in it.
ReadBack = Callable[[Path, TriangleMesh], tuple[NDArray[Any], ...]]
M = TypeVar("M", bound=TriangleMesh)


def read_mesh(path: str | os.PathLike[str], mesh_type: type[M] = DiskMesh) -> M:  # type: ignore[assignment]
    """Read a file as a checked surface, which is named after the file's stem.

    Raises
    ------
    MeshError
        The file is missing, empty, of unknown format or damaged, or its mesh fails a check.

    Examples
    --------
    >>> write_mesh("triangle.obj", DiskMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> read_mesh("triangle.obj").F.tolist()
    [[0, 1, 2]]

    """
    return checked(read_soup(path), mesh_type, Path(path))


def read_repaired(path: Path) -> tuple[Soup, Repaired]:
    """Read a file and repair it: the largest surface in it, and what was done.

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
    """Check the polygons of a file as a surface of this kind, cut into triangles.

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


def write_mesh(
    path: str | os.PathLike[str], mesh: TriangleMesh, uv: NDArray[np.complex128] | None = None
) -> None:
    """Write the surface, and the map as its texture coordinates, in full precision.

    The file appears whole or not at all, and only if it holds every coordinate and every triangle
    when it is read back: libraries that write do not all report a full disk. UVs are the shortest
    decimals that read back as the same numbers (OBJ) or float64 (PLY): with fewer digits, triangles
    fold where the map shrinks the surface. They are the map itself, not moved into the unit square.

    Raises
    ------
    MeshError
        Unknown format, one that cannot hold UVs (OFF, STL), or a folder that cannot be written.

    """
    path = Path(path)
    check_writable_format(path, with_uv=uv is not None)
    UV = None if uv is None else np.stack([uv.real, uv.imag], axis=1)
    write, read_back = _WRITERS[path.suffix.lower()]
    write_by(
        path,
        lambda draft: write(draft, mesh, UV),
        check=lambda draft: _check_written(read_back, draft, mesh, UV),
        error=MeshError,
        parents=False,
    )


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
    uv = None if UV is None else np.asarray(UV) @ np.array([1, 1j])
    path.write_text(obj_text(mesh.V, mesh.F, uv), encoding="utf-8")


def _write_ply(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    extra = {} if UV is None else {"UV": UV}
    igl.writePLY(path, mesh.V.copy(), mesh.F.copy(), **extra)


def _write_off(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    # Own code, because libigl and trimesh write fewer digits than a double has.
    lines = [f"OFF\n{mesh.n} {mesh.m} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.V.tolist()]
    lines += [f"3 {i} {j} {k}" for i, j, k in mesh.F.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_stl(path: Path, mesh: TriangleMesh, UV: ArrayLike | None) -> None:
    igl.writeSTL(str(path), mesh.V.copy(), mesh.F.copy(), binary=True)


def _check_written(
    read_back: ReadBack, path: Path, mesh: TriangleMesh, UV: NDArray[np.float64] | None
) -> None:
    """Raise OSError where a file does not hold what was to be written.

    STL has no connectivity and single precision: its triangles' corners are compared.
    """
    wanted: tuple[NDArray[Any], ...] = (mesh.V, mesh.F) if UV is None else (mesh.V, mesh.F, UV)
    if read_back is _stl_arrays:
        wanted = (mesh.V[mesh.F].astype(np.float32),)
    try:
        found = read_back(path, mesh)
    except Exception:  # the libraries raise anything on a file that is cut short
        found = ()
    if len(found) != len(wanted) or not all(map(np.array_equal, found, wanted)):
        size = path.stat().st_size
        raise OSError(errno.EIO, f"only {size} bytes of it arrived; is the disk full?")


def _obj_arrays(path: Path, mesh: TriangleMesh) -> tuple[NDArray[Any], ...]:
    V, UV, _, F, _, _ = igl.readOBJ(path)
    return (V, F, UV) if len(UV) else (V, F)


def _off_arrays(path: Path, mesh: TriangleMesh) -> tuple[NDArray[Any], ...]:
    found = read_off(path)
    return found.V, found.triangles


def _ply_arrays(path: Path, mesh: TriangleMesh) -> tuple[NDArray[Any], ...]:
    header, end, body = path.read_bytes().partition(b"end_header\n")
    if not end or b"format binary_little_endian 1.0" not in header:
        return ()
    columns = header.count(b"property double")
    face = np.dtype([("corners", "u1"), ("F", "<i4", 3)])
    split = 8 * columns * mesh.n
    coordinates = np.frombuffer(body[:split], "<f8").reshape(mesh.n, columns)
    V, UV = coordinates[:, :3], coordinates[:, 3:]
    F = np.frombuffer(body[split:], face)["F"]
    return (V, F, UV) if columns > 3 else (V, F)


def _stl_arrays(path: Path, mesh: TriangleMesh) -> tuple[NDArray[Any], ...]:
    facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return (np.frombuffer(path.read_bytes()[84:], facet)["corners"],)


_WRITERS: dict[str, tuple[Writer, ReadBack]] = {
    ".obj": (_write_obj, _obj_arrays),
    ".off": (_write_off, _off_arrays),
    ".ply": (_write_ply, _ply_arrays),
    ".stl": (_write_stl, _stl_arrays),
}
_WITH_UV = (".obj", ".ply")
