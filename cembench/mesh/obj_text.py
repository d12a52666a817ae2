"""OBJ files as text: compose a new one, or replace the texture coordinates of an existing one.

Numbers are written as the shortest decimals that read back as the same double.
"""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.obj_reader import statement_words

Points = NDArray[np.float64]
Indices = NDArray[np.int64]
#: A face's corners: the vertex, counted from 0, and the normal's index as in the file.
Face = Sequence[tuple[int, str]]
#: Texture coordinate of each vertex of a triangle, by the triangle's vertices.
Corners = Mapping[frozenset[int], Mapping[int, int]]


def obj_text(
    V: Points,
    F: Indices,
    uv: NDArray[np.complex128] | None = None,
    uv_index: Indices | None = None,
) -> str:
    """Return an OBJ file of triangles as text.

    Parameters
    ----------
    V, F : float64 (n, 3), int64 (m, 3)
        The surface.
    uv : complex128 (k,), optional
        Texture coordinates.
    uv_index : int64 (m, 3), optional
        The texture coordinate of each corner (default: that of its vertex).

    """
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in V.tolist()]
    if uv is None:
        lines += [f"f {i} {j} {k}" for i, j, k in (F + 1).tolist()]
    else:
        lines += _uv_lines(uv)
        corners = np.stack([F, F if uv_index is None else uv_index], axis=2).reshape(-1, 6) + 1
        lines += [f"f {a}/{s} {b}/{t} {c}/{u}" for a, s, b, t, c, u in corners.tolist()]
    return "\n".join(lines) + "\n"


def with_uv(
    text: str,
    uv: NDArray[np.complex128],
    F: Indices | None = None,
    uv_index: Indices | None = None,
) -> str:
    """Replace the texture coordinates of an OBJ file; keep everything else line by line.

    Groups, materials, normals, colours, comments and polygons are kept; old texture coordinates are
    removed.

    Parameters
    ----------
    text : str
        The file, decoded as Latin-1 so that every byte is a character; names may have any encoding.
    uv : complex128 (k,)
        Texture coordinates: number i belongs to vertex i, those after the last vertex to corners.
    F, uv_index : int64 (m, 3), optional
        The triangles of the surface and the texture coordinate of each corner, if corners differ
        from their vertices. A face of the file is found by its vertices. A polygon with a seam
        across it is replaced by its triangles.

    """
    corners: Corners = {}
    if F is not None and uv_index is not None:
        faces = sum(words[:1] in (["f"], ["fo"]) for _, words in _statements(text))
        only_triangles = faces == len(F)
        corners = _by_vertices(F, uv_index, only_at_seams=only_triangles)
    lines: list[str] = []
    vertices, written = 0, False
    for line, words in _statements(text):
        kind = words[0] if words else ""
        if kind == "vt":
            continue
        if kind == "v":
            vertices += 1
        elif kind in ("f", "fo", "l"):
            if not written:
                lines += _uv_lines(uv)
                written = True
            face = [_reference(word, vertices) for word in words[1:]]
            if kind == "l":
                line = " ".join(["l", *(str(v + 1) for v, _ in face)])
            else:
                line = "\n".join(_face_lines(face, corners))
        lines.append(line)
    return "\n".join(lines) + "\n"


def _statements(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the unchanged lines of each statement, and its words as the reader splits them.

    Comments and names have no continuation lines.
    """
    lines = enumerate(io.StringIO(text), 1)
    for number, line in lines:
        whole = [line]
        words = statement_words(number, line, _noted(lines, whole))
        yield "".join(whole).removesuffix("\n"), words


def _noted(lines: Iterator[tuple[int, str]], whole: list[str]) -> Iterator[tuple[int, str]]:
    """Yield numbered lines, and append each to `whole` on the way."""
    for number, line in lines:
        whole.append(line)
        yield number, line


def _uv_lines(uv: NDArray[np.complex128]) -> Iterable[str]:
    return [f"vt {u!r} {v!r}" for u, v in zip(uv.real.tolist(), uv.imag.tolist(), strict=True)]


def _reference(word: str, vertices: int) -> tuple[int, str]:
    """Return the vertex of a face's corner, from 0, and the text after its second slash."""
    parts = word.split("/")
    index = int(parts[0])
    return (index - 1 if index > 0 else vertices + index), parts[2] if len(parts) > 2 else ""


def _face_lines(face: Face, corners: Corners) -> list[str]:
    """Return the lines of a face with its texture coordinates; triangles across a seam."""
    triangles = [
        (three, corners[key])
        for three in (combinations(face, 3) if corners else ())
        if (key := frozenset(v for v, _ in three)) in corners
    ]
    found: dict[int, set[int]] = defaultdict(set)
    for _, uv in triangles:
        for v, t in uv.items():
            found[v].add(t)
    if all(len(several) == 1 for several in found.values()):
        return [_face_line(face, {v: t for v, (t,) in found.items()})]
    return [_face_line(three, uv) for three, uv in triangles]


def _face_line(face: Face, uv: Mapping[int, int]) -> str:
    """Return the line of a face whose corners have these texture coordinates."""
    corners = [
        f"{v + 1}/{uv.get(v, v) + 1}" + (f"/{normal}" if normal else "") for v, normal in face
    ]
    return " ".join(["f", *corners])


def _by_vertices(F: Indices, uv_index: Indices, *, only_at_seams: bool) -> Corners:
    """Return the texture coordinates of all triangles, or of those at seams, by vertices."""
    at_seam = np.isin(F, F[uv_index != F]).any(axis=1) | (not only_at_seams)
    return {
        frozenset(face): dict(zip(face, uv, strict=True))
        for face, uv in zip(F[at_seam].tolist(), uv_index[at_seam].tolist(), strict=True)
    }
