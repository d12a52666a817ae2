"""Read UVs that programs write: OBJ, OFF, PLY, MAT, NPZ and text, at vertices or at corners.

The file may also hold the surface that the UVs belong to. :func:`uv_of_corners` checks that it is
the surface that the program was given.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.errors import MeshError, RecordError, describe_error
from cembench.core.loading import read_arrays
from cembench.mesh.mat_reader import mat_arrays
from cembench.mesh.obj_reader import statement_words
from cembench.mesh.ply_reader import read_ply_texture
from cembench.mesh.reading import read_soup
from cembench.mesh.soup import damaged, shown

Points = NDArray[np.float64]
Indices = NDArray[np.int64]
Complex = NDArray[np.complex128]

#: Allowed distance of a vertex from its original position, relative to the surface's extent: single
#: precision and six decimals are accepted.
SAME_PLACE = 1e-5
#: Accepted names of arrays of UVs, and of their indices at corners.
_UV_NAMES = ("uv", "UV")
_INDEX_NAMES = ("fuv", "FUV", "ftc", "FTC")
#: Keywords of OFF files whose vertices end with two texture coordinates.
_STOFF = re.compile("STC?N?OFF")
#: Marks a corner without a UV.
NO_UV = -(2**62)


class OtherSurfaceError(MeshError):
    """A file holds UVs of a different surface than expected."""


@dataclass(frozen=True, eq=False)
class UVFile:
    """The content of a file with UVs.

    Parameters
    ----------
    uv : complex128 (k,)
        Texture coordinates.
    V, F : float64 (n', 3) and int64 (m', 3), or None
        The surface in the file, if there is one; without V, F refers to the original vertices.
    index : int64 (m', 3) or None
        The texture coordinate of each corner; None: that of its vertex.

    """

    uv: Complex
    V: Points | None = None
    F: Indices | None = None
    index: Indices | None = None


def read_uv(path: Path) -> UVFile:
    """Read the UVs of a file, in the format that its suffix names.

    Raises
    ------
    MeshError
        The file is damaged, cut short or holds no UVs.

    """
    try:
        return UV_READERS[path.suffix.lower()](path)
    except RecordError as error:
        raise MeshError(str(error)) from error
    except (OSError, ValueError, OverflowError, IndexError, KeyError) as error:
        raise MeshError(f"{path.name} cannot be read: {describe_error(error)}") from error


def read_flat(path: Path) -> UVFile:
    """Read a flattened surface from a mesh file, with x and y as its UVs.

    Raises
    ------
    MeshError
        The file is damaged, or its vertices do not lie in the plane z = 0.

    """
    soup = read_soup(path)
    V, F = soup.V, soup.triangles
    if np.abs(V[:, 2]).max() > SAME_PLACE * np.ptp(V[:, :2], axis=0).max():
        raise MeshError("its vertices do not lie in the plane z = 0: it is not a flat map")
    return UVFile(V[:, 0] + 1j * V[:, 1], F=F, index=F)


def uv_of_corners(file: UVFile, V: Points, F: Indices) -> Complex:
    """Return the UV of each corner (m, 3) of a surface from a file that should hold that surface.

    Programs that cut a surface may write vertices in another order or several times, and triangles
    in another order; they are matched by position.

    Raises
    ------
    OtherSurfaceError
        The file holds other vertices or triangles.
    MeshError
        There is not one UV for each vertex or corner.

    """
    corners = file.F if file.index is None else file.index
    if corners is None:
        if len(file.uv) == len(V):
            return file.uv[F]
        if len(file.uv) == F.size:
            return file.uv.reshape(F.shape)
        raise OtherSurfaceError(
            f"it holds {len(file.uv)} UVs; required is one for each of the {len(V)} vertices, or "
            f"for each of the {F.size} corners"
        )
    if len(corners) != len(F):
        raise OtherSurfaceError(f"it holds {len(corners)} triangles; the surface has {len(F)}")
    if corners.min() < 0 or corners.max() >= len(file.uv):
        raise MeshError(
            f"a corner has UV number {int(corners.max())}, but there are {len(file.uv)} UVs"
        )
    uv = file.uv[corners]
    if file.F is None:
        return uv
    at, turn = _places(file.F if file.V is None else _vertex_numbers(file.V, V)[file.F], F)
    return np.take_along_axis(uv[at], (np.arange(3) + turn[:, None]) % 3, axis=1)


def _vertex_numbers(found: Points, V: Points) -> Indices:
    """Return the vertex of V that each vertex of a file is."""
    from scipy.spatial import cKDTree

    extent = float(np.ptp(V, axis=0).max())
    if not np.isfinite(found).all():
        raise OtherSurfaceError("a vertex in it is NaN or infinite")
    if found.shape == V.shape and np.abs(found - V).max() <= SAME_PLACE * extent:
        return np.arange(len(V), dtype=np.int64)
    away, number = cKDTree(V).query(found)
    if away.max() > SAME_PLACE * extent:
        far = int(np.argmax(away))
        raise OtherSurfaceError(
            f"it holds other vertices: {len(found)} of them, the surface has {len(V)}, and vertex "
            f"{far} (counted from 0) lies {away[far]:.3g} from the nearest of these"
        )
    return number.astype(np.int64)


def _places(G: Indices, F: Indices) -> tuple[Indices, Indices]:
    """Return for each triangle of F its index in G, and which corner comes first there."""
    (g, turn_g), (f, turn_f) = _turned(G), _turned(F)
    order_g, order_f = (np.lexsort(A.T[::-1]) for A in (g, f))
    if not (g[order_g] == f[order_f]).all():
        wrong = int((g[order_g] != f[order_f]).any(axis=1).sum())
        raise OtherSurfaceError(
            f"it holds other triangles: {wrong} of {len(F)} differ from those of the surface, or "
            "have the opposite orientation"
        )
    at = np.empty(len(F), dtype=np.int64)
    at[order_f] = order_g
    return at, (turn_g[at] - turn_f) % 3


def _turned(F: Indices) -> tuple[Indices, Indices]:
    """Rotate triangles so that their smallest vertex comes first; also return that corner."""
    first = F.argmin(axis=1)
    turned = np.take_along_axis(F, (np.arange(3) + first[:, None]) % 3, axis=1)
    return turned, first.astype(np.int64)


def _read_obj(path: Path) -> UVFile:
    """Read the UVs of an OBJ file, with the surface that it holds."""
    V: list[list[float]] = []
    uv: list[complex] = []
    faces: list[list[tuple[int, int]]] = []
    with path.open(encoding="latin-1") as file:
        lines = enumerate(file, 1)
        for number, line in lines:
            words = statement_words(number, line, lines)
            kind = words[0] if words else ""
            try:
                if kind == "v":
                    V.append([float(word) for word in words[1:4]])
                elif kind == "vt":
                    uv.append(complex(float(words[1]), float(words[2])))
                elif kind == "f":
                    face = [_reference(word, len(V), len(uv)) for word in words[1:]]
                    if len(face) < 3:
                        raise ValueError(f"a face needs 3 corners, but this one has {len(face)}")
                    faces += [[face[0], face[k], face[k + 1]] for k in range(1, len(face) - 1)]
            except (ValueError, IndexError) as error:
                raise damaged(f"line {number}, {shown(line)}: {error}") from None
    if not uv:
        raise damaged("it holds no UVs: no line that begins with vt")
    if not faces:
        return UVFile(np.array(uv))
    corners = np.array(faces, dtype=np.int64)
    F, index = corners[:, :, 0], corners[:, :, 1]
    if F.min() < 0 or F.max() >= len(V):
        raise damaged(f"a triangle has vertex {int(F.max()) + 1}, but there are {len(V)}")
    if (index == NO_UV).all() and len(uv) == len(V):
        index = F
    if (index == NO_UV).any():
        raise damaged("a triangle has a corner without a UV; write f vertex/uv vertex/uv ...")
    return UVFile(np.array(uv), np.array(V).reshape(-1, 3), F, index)


def _reference(word: str, vertices: int, uvs: int) -> tuple[int, int]:
    """Return the indices, from 0, of the vertex and the UV that a corner names."""
    parts = word.split("/")
    at = int(parts[0])
    v = at - 1 if at > 0 else vertices + at
    if len(parts) < 2 or not parts[1]:
        return v, NO_UV
    at = int(parts[1])
    return v, at - 1 if at > 0 else uvs + at


def _read_off(path: Path) -> UVFile:
    """Read OFF with two texture coordinates at the end of each vertex, as STOFF declares."""
    text = "\n".join(line.split("#", 1)[0] for line in path.read_text("latin-1").splitlines())
    lines = [line.split() for line in text.splitlines() if line.strip()]
    if not lines or not _STOFF.fullmatch(lines[0][0]):
        raise damaged("it holds no UVs: the first word is not STOFF")
    head = lines[0][1:]
    if not head:
        head, lines = lines[1], lines[1:]
    n, m = int(head[0]), int(head[1])
    rows = lines[1 : 1 + n + m]
    if len(rows) < n + m:
        raise damaged(f"{n} vertices and {m} faces are declared, but {len(rows)} lines follow")
    vertices = np.array([row[:3] + row[-2:] for row in rows[:n]], dtype=np.float64)
    faces = [[int(word) for word in row[1 : 1 + int(row[0])]] for row in rows[n:]]
    short = next((row for row, p in zip(rows[n:], faces, strict=True) if len(p) < 3), None)
    if short is not None:
        raise damaged(f"a face needs 3 corners; {shown(' '.join(short))} has fewer")
    F = np.array([[p[0], p[k], p[k + 1]] for p in faces for k in range(1, len(p) - 1)])
    if F.min() < 0 or F.max() >= n:
        raise damaged(f"a face has vertex {int(F.max())}, but there are {n}")
    return UVFile(vertices[:, 3] + 1j * vertices[:, 4], vertices[:, :3], F.astype(np.int64))


def _read_ply(path: Path) -> UVFile:
    """Read the UVs of a PLY file, with the surface that it holds."""
    V, F, uv, index = read_ply_texture(path)
    return UVFile(uv[:, 0] + 1j * uv[:, 1], V, F, index)


def _read_mat(path: Path) -> UVFile:
    """Read the UVs of a MATLAB file of versions 5 to 7.2."""
    wanted = (*_UV_NAMES, *_INDEX_NAMES)
    names: list[str] = []

    def is_wanted(name: str, shape: list[int]) -> bool:
        names.append(name)
        return name in wanted

    found = mat_arrays(path.read_bytes(), is_wanted)
    return _named_arrays(found or dict.fromkeys(names), first=1)


def _read_npz(path: Path) -> UVFile:
    """Read the UVs of a NumPy archive."""
    import zipfile

    try:
        with zipfile.ZipFile(path) as archive:
            names = [name.removesuffix(".npy") for name in archive.namelist()]
    except zipfile.BadZipFile as error:
        raise damaged(f"it cannot be read as NPZ: {error}") from None
    wanted = [name for name in names if name in (*_UV_NAMES, *_INDEX_NAMES)]
    return _named_arrays(read_arrays(path, wanted), first=0)


def _named_arrays(found: dict[str, Any], first: int) -> UVFile:
    """Return UVs from arrays: ``uv`` (k, 2) or complex (k,), and ``fuv`` (m, 3)."""
    uv = next((found[name] for name in _UV_NAMES if name in found), None)
    index = next((found[name] for name in _INDEX_NAMES if name in found), None)
    if uv is None:
        named = ", ".join(found) or "none"
        raise damaged(f"it holds no array uv (k, 2); its arrays are: {named}")
    whole = None if index is None else np.asarray(index, dtype=np.int64).reshape(-1, 3) - first
    return UVFile(_complex(uv), index=whole)


def _read_text(path: Path) -> UVFile:
    """Read two numbers per line, for each vertex or for each corner."""
    rows = [line.replace(",", " ").split() for line in path.read_text("latin-1").splitlines()]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    bad = next((row for row in rows if len(row) != 2), None)
    if bad is not None or not rows:
        told = shown(" ".join(bad)) if bad else "nothing"
        raise damaged(f"two numbers per line are required; it holds {told}")
    return UVFile(_complex(np.array(rows, dtype=np.float64)))


def _complex(uv: ArrayLike) -> Complex:
    """Return UVs (k, 2) or complex (k,) as complex numbers."""
    a = np.asarray(uv)
    if a.dtype.kind == "c":
        return np.ascontiguousarray(a.ravel(), dtype=np.complex128)
    if a.ndim != 2 or a.shape[1] not in (2, 3) or a.dtype.kind not in "fiu":
        raise damaged(f"uv is {a.dtype} {a.shape}; required is real (k, 2) or complex (k,)")
    a = a.astype(np.float64)
    return a[:, 0] + 1j * a[:, 1]


UV_READERS: dict[str, Callable[[Path], UVFile]] = {
    ".obj": _read_obj,
    ".off": _read_off,
    ".ply": _read_ply,
    ".mat": _read_mat,
    ".npz": _read_npz,
    ".txt": _read_text,
}
