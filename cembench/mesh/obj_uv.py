"""Read the texture coordinates of an OBJ file."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError
from cembench.mesh.obj_reader import statement_words


def read_obj_uv(path: Path, F: NDArray[np.int64]) -> NDArray[np.float64]:
    """Read the texture coordinates of an OBJ file at the corners of its triangles.

    Parameters
    ----------
    path : Path
        A file that was read as a surface, so its statements of vertices and faces are valid.
    F : int64 (m, 3)
        The triangles of that surface: the file's faces in order, cut into triangles.

    Returns
    -------
    float64 (m, 3, 2)
        As in the file; v points up.

    Raises
    ------
    MeshError
        The file is not OBJ, or some corners have no texture coordinates.

    """
    if path.suffix.lower() != ".obj":
        raise MeshError(
            f"{path}: the texture coordinates that a texture was made for are read from OBJ files "
            "only. Convert the surface to OBJ."
        )
    points, triangles = _read(path)
    if len(triangles) != len(F):
        raise MeshError(f"{path}: its faces are not those of the surface; map it without --repair.")
    vertex, texture = triangles[:, :, 0], triangles[:, :, 1]
    if (texture < 0).any() or (texture >= len(points)).any():
        count = int(((texture < 0) | (texture >= len(points))).any(axis=1).sum())
        raise MeshError(
            f"{path}: {count} of {len(F)} triangles have no texture coordinates (vt), so there is "
            "no texture to transfer. Name the file that the texture belongs to."
        )
    matches = F[:, :, None] == vertex[:, None, :]  # checks may have reversed a triangle
    if not matches.any(axis=2).all():
        raise MeshError(f"{path}: its faces are not those of the surface; map it without --repair.")
    return points[np.take_along_axis(texture, matches.argmax(axis=2), axis=1)]


def _read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the coordinates (k, 2), and each corner's vertex and coordinate (m, 3, 2) from 0."""
    points: list[tuple[float, float]] = []
    triangles = []
    vertices = 0
    with path.open(encoding="latin-1") as file:
        lines = enumerate(file, 1)
        for number, line in lines:
            words = statement_words(number, line, lines)
            kind = words[0] if words else ""
            if kind == "v":
                vertices += 1
            elif kind == "vt":
                points.append(_point(path, number, words))
            elif kind in ("f", "fo"):
                face = [_corner(word, vertices, len(points)) for word in words[1:]]
                triangles += [(face[0], b, c) for b, c in pairwise(face[1:])]
    found = np.array(points, dtype=np.float64).reshape(-1, 2)
    return found, np.array(triangles, dtype=np.int64).reshape(-1, 3, 2)


def _point(path: Path, number: int, words: list[str]) -> tuple[float, float]:
    """Return the texture coordinate of a line."""
    try:
        u, v = (float(word) for word in [*words[1:], "0"][:2])
    except ValueError:
        raise MeshError(
            f"{path}: line {number} is not a texture coordinate; it needs numbers."
        ) from None
    if not (np.isfinite(u) and np.isfinite(v)):
        raise MeshError(f"{path}: line {number} has a texture coordinate that is not finite.")
    return u, v


def _corner(word: str, vertices: int, points: int) -> tuple[int, int]:
    """Return the indices, from 0, of the vertex and the texture coordinate of a corner."""
    vertex, texture = [*word.split("/"), ""][:2]
    return _from_0(int(vertex), vertices), _from_0(int(texture), points) if texture else -1


def _from_0(index: int, count: int) -> int:
    """Return an OBJ index, which may count back from the end, counted from 0."""
    return index - 1 if index > 0 else count + index
