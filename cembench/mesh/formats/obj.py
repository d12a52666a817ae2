"""Wavefront OBJ: vertices, polygons and texture coordinates, read and written.

Own code, because meshio, trimesh and libigl each lose faces of valid files silently (after a tab,
in an indented line, in a truncated last line) or refuse them (comments after a face, texture seams,
Latin-1 text). Numbers are written as the shortest decimals that read back as the same double.

A file of nothing but plain lines is read and changed in blocks; any other one statement by
statement, with the same result.
"""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cembench.core.arrays import Complex, Indices
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import (
    BYTE_ORDER_MARK,
    NO_UV,
    Soup,
    complex_of,
    numbers_of,
    refuse_underscores,
    shown,
    to_number,
    unreadable,
    words_of,
)

_FACES = ("f", "fo")
#: Statements without polygons, which are skipped; any other word is reported.
_SKIPPED = frozenset(
    "vt vn vp deg bmat step cstype p l curv curv2 surf parm trim hole scrv sp end con bevel "  # noqa: SIM905
    "c_interp d_interp lod shadow_obj trace_obj ctech stech call csh bsp bzp cdc cdp res".split()
)
#: Statements that end with a name, which may end with a backslash.
_NAMED = frozenset(("o", "g", "s", "mg", "usemtl", "mtllib", "usemap", "maplib"))
#: Blocks of plain lines: vertices of three numbers, faces with positive indices, and statements of
#: other kinds; none has a comment after a statement or a continuation line.
_PLAIN = re.compile(
    rb"(?P<v>(?:v(?:[ \t]++[-+0-9.eE]++){3}[ \t]*+\n)++)"
    rb"|(?P<f>(?:f(?:[ \t]++[1-9][0-9]{0,17}+(?:/[0-9]*+(?:/[0-9]++)?+)?+){3,}+[ \t]*+\n)++)"
    rb"|(?:(?:(?:#|(?:v[nt]|[gos]|usemtl|mtllib)[ \t])[^\\\r\n]*+)?+\n)++"
)
#: Name of the material in OBJ and MTL.
MATERIAL = "map"


def read(path: Path, *, uv: bool = False) -> Soup:
    """Read the vertices and polygons of an OBJ file, with `uv` its texture coordinates, too.

    Texture seams do not cut the surface.
    """
    plain = None if uv else _read_plain(path.read_bytes())
    return plain or _read_statements(path, uv=uv)


def _plain_blocks(content: bytes) -> list[tuple[str | None, bytes]] | None:
    """Return the blocks of a file with their kinds: "v", "f" or None; None for any other file."""
    content = content.replace(b"\r\n", b"\n")
    if not content.endswith(b"\n"):
        content += b"\n"
    blocks, at = [], 0
    while at < len(content):
        block = _PLAIN.match(content, at)
        if block is None:
            return None
        blocks.append((block.lastgroup, block[0]))
        at = block.end()
    return blocks


def _read_plain(content: bytes) -> Soup | None:
    """Return the surface of a file of plain lines; None for any other file."""
    blocks = _plain_blocks(content)
    if blocks is None or all(kind != "f" for kind, _ in blocks):
        return None
    points, faces = (b"".join(text for kind, text in blocks if kind == which) for which in "vf")
    if b"/" in faces:
        faces = re.sub(rb"/[0-9/]*+", b"", faces)
    faces = faces.replace(b"f", b" ")
    V, corners = numbers_of(points.replace(b"v", b" ")), numbers_of(faces, np.int64)
    if V is None or corners is None or len(V) != 3 * points.count(b"\n"):
        return None
    letters = np.frombuffer(faces, np.uint8)
    starts = np.flatnonzero((letters[:-1] <= ord(" ")) & (letters[1:] > ord(" ")))
    ends = np.flatnonzero(letters == ord("\n"))
    sizes = np.diff(np.searchsorted(starts, ends), prepend=0)
    return Soup.from_arrays(V, corners, sizes, counted_from=1)


def _read_statements(path: Path, *, uv: bool) -> Soup:
    """Read any file statement by statement."""
    coordinates, corners, sizes = array("d"), array("q"), array("q")
    texture, uv_index = array("d"), array("q")
    unknown: list[str] = []
    # Latin-1 decodes any bytes: names and comments may have any encoding.
    with path.open(encoding="latin-1") as file:
        lines = enumerate(file, 1)
        for number, line in lines:
            words = _statement_words(number, line, lines)
            if not words or words[0] in _NAMED:
                continue
            try:
                if words[0] == "v":
                    coordinates.extend(_point(words))
                elif words[0] in _FACES:
                    face = _face(words, len(coordinates) // 3)
                    corners.extend(face)
                    sizes.append(len(face))
                    if uv:
                        uv_index.extend(_uv_indices(words, len(texture) // 2))
                elif uv and words[0] == "vt":
                    texture.extend(_texture_coordinate(words))
                elif words[0] and words[0] not in _SKIPPED:
                    unknown.append(f"line {number}, {shown(line)}")
            except (ValueError, OverflowError) as error:
                raise unreadable(f"line {number}", line, error) from None
    more = {"uv": complex_of(texture), "uv_index": np.asarray(uv_index)} if uv else {}
    return Soup.from_arrays(
        coordinates, corners, sizes, counted_from=1, notices=_unknown_notice(unknown), **more
    )


def _statement_words(number: int, line: str, lines: Iterator[tuple[int, str]]) -> list[str]:
    """Return the words of the statement that starts in a line, including continuation lines."""
    words = words_of(line)
    if words and words[0] not in _NAMED and ("#" in line or "\\" in line or number == 1):
        return _whole_statement(line, lines)
    return words


def _whole_statement(line: str, lines: Iterator[tuple[int, str]]) -> list[str]:
    """Return the words of a line without its comment, and of the lines that continue it.

    The result is never empty: an empty statement is one empty word.
    """
    words: list[str] = []
    while True:
        text, comment, _ = line.removeprefix(BYTE_ORDER_MARK).partition("#")
        words += words_of(text)
        if comment or not words or not words[-1].endswith("\\"):
            return words or [""]
        words[-1:] = words[-1].removesuffix("\\").split()
        line = next(lines, (0, ""))[1]


def _point(words: list[str]) -> list[float]:
    """Return the three coordinates; a weight or a colour may follow them."""
    numbers = [to_number(float, word) for word in words[1:]]
    if len(numbers) < 3:
        raise ValueError(f"a vertex needs 3 numbers, but this one has {len(numbers)}")
    refuse_underscores(words)
    return numbers[:3]


def _texture_coordinate(words: list[str]) -> list[float]:
    """Return the two coordinates; the second one is 0 unless it is given."""
    try:
        u, v = (float(word) for word in [*words[1:], "0"][:2])
    except ValueError:
        raise ValueError("this is not a texture coordinate; it needs numbers") from None
    return [u, v]


def _face(words: list[str], vertices: int) -> list[int]:
    """Return vertex indices, counted from 1; negative ones count back from the latest vertex."""
    face = [to_number(int, word.split("/", 1)[0]) for word in words[1:]]
    if len(face) < 3:
        raise ValueError(f"a face needs 3 corners, but this one has {len(face)}")
    refuse_underscores(words)
    if min(face) < 1:
        if 0 in face or min(face) < -vertices:
            raise ValueError(
                f"vertex index out of range; allowed are 1 to {vertices}, or -1 to -{vertices} "
                "counted backward"
            )
        face = [k if k > 0 else vertices + 1 + k for k in face]
    return face


def _uv_indices(words: list[str], count: int) -> list[int]:
    """Return the texture coordinates of a face's corners, counted from 0."""
    named = [[*word.split("/"), ""][1] for word in words[1:]]
    return [_from_0(to_number(int, k), count) if k else NO_UV for k in named]


def _from_0(index: int, count: int) -> int:
    """Return an OBJ index, which may count back from the latest of `count`, counted from 0."""
    return index - 1 if index > 0 else count + index


def _unknown_notice(unknown: list[str]) -> tuple[Notice, ...]:
    if not unknown:
        return ()
    text = (
        f"lines that are not statements of OBJ were ignored: {len(unknown)}, the first: "
        f"{unknown[0]}"
    )
    return (Notice(NoticeKind.LINES_IGNORED, text),)


def write(surface: Soup) -> bytes:
    """Return an OBJ file of the triangles, and of their texture coordinates if there are any."""
    F = surface.triangles
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.V.tolist()]
    if surface.uv is None:
        lines += [f"f {i} {j} {k}" for i, j, k in (F + 1).tolist()]
    else:
        lines += _uv_lines(surface.uv)
        corners = np.stack([F, surface.uv_triangles], axis=2).reshape(-1, 6) + 1
        lines += [f"f {a}/{s} {b}/{t} {c}/{u}" for a, s, b, t, c, u in corners.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _uv_lines(uv: Complex) -> list[str]:
    return [f"vt {u!r} {v!r}" for u, v in zip(uv.real.tolist(), uv.imag.tolist(), strict=True)]


def with_uv(
    text: str, uv: Complex, F: Indices | None = None, uv_index: Indices | None = None
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
        The triangles of the file's polygons in order, in either orientation, and the texture
        coordinate of each corner, if corners differ from their vertices. A polygon with a seam
        across it is replaced by its triangles.
    """
    blocks = None if uv_index is not None else _plain_blocks(text.encode("latin-1"))
    if blocks is not None:
        return _with_uv_in_blocks(blocks, uv)
    corners: list[dict[int, int]] = []
    if F is not None and uv_index is not None:
        pairs = zip(F.tolist(), uv_index.tolist(), strict=True)
        corners = [dict(zip(face, own, strict=True)) for face, own in pairs]
    triangles = iter(corners)
    lines: list[str] = []
    vertices, written = 0, False
    for line, words in _statements(text):
        kind = words[0] if words else ""
        if kind == "vt":
            continue
        if kind == "v":
            vertices += 1
        elif kind in _FACES or kind == "l":
            if not written:
                lines += _uv_lines(uv)
                written = True
            face = [_vertex_and_normal(word, vertices) for word in words[1:]]
            if kind == "l":
                line = " ".join(["l", *(str(v + 1) for v, _ in face)])
            else:
                of_face = [own for _, own in zip(face[2:], triangles, strict=False)]
                line = "\n".join(_face_lines(face, of_face))
        lines.append(line)
    return "\n".join(lines) + "\n"


def _with_uv_in_blocks(blocks: list[tuple[str | None, bytes]], uv: Complex) -> str:
    """Return blocks of plain lines with a texture coordinate for each vertex."""
    parts: list[str] = []
    written = False
    for kind, block in blocks:
        if kind is None:
            block = re.sub(rb"(?m)^vt[^\n]*+\n", b"", block)
        elif kind == "f":
            if not written:
                parts.append("\n".join([*_uv_lines(uv), ""]))
                written = True
            block = _with_vertex_uv(block)
        parts.append(block.decode("latin-1"))
    return "".join(parts)


def _with_vertex_uv(faces: bytes) -> bytes:
    """Return plain faces whose corners have the texture coordinates of their vertices."""
    words = faces.decode().split()
    if b"/" not in faces and len(words) == 4 * faces.count(b"\n"):  # triangles, by a faster way
        corners = zip(words[1::4], words[2::4], words[3::4], strict=True)
        return "".join([f"f {i}/{i} {j}/{j} {k}/{k}\n" for i, j, k in corners]).encode()
    faces = re.sub(rb"[ \t]++([0-9]++)(?:/[0-9]*+(/[0-9]++)?+)?+", rb" \1/\1\2", faces)
    return re.sub(rb"[ \t]++\n", b"\n", faces)


def _statements(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the unchanged lines of each statement, and its words as the reader splits them.

    Comments and names have no continuation lines.
    """
    whole: list[str] = []

    def numbered() -> Iterator[tuple[int, str]]:
        for number, line in enumerate(io.StringIO(text), 1):
            whole.append(line)
            yield number, line

    lines = numbered()
    for number, line in lines:
        words = _statement_words(number, line, lines)
        yield "".join(whole).removesuffix("\n"), words
        whole.clear()


def _vertex_and_normal(word: str, vertices: int) -> tuple[int, str]:
    """Return the vertex of a face's corner, from 0, and the text after its second slash."""
    parts = word.split("/")
    return _from_0(int(parts[0]), vertices), parts[2] if len(parts) > 2 else ""


def _face_lines(face: list[tuple[int, str]], triangles: list[dict[int, int]]) -> list[str]:
    """Return the lines of a face with its texture coordinates; triangles across a seam."""
    uv = {v: t for triangle in triangles for v, t in triangle.items()}
    if any(uv[v] != t for triangle in triangles for v, t in triangle.items()):
        return [_face_line([c for c in face if c[0] in own], own) for own in triangles]
    return [_face_line(face, uv)]


def _face_line(face: list[tuple[int, str]], uv: dict[int, int]) -> str:
    """Return the line of a face whose corners have these texture coordinates."""
    corners = (f"{v + 1}/{uv.get(v, v) + 1}" + (f"/{n}" if n else "") for v, n in face)
    return " ".join(["f", *corners])


def with_material(text: str, library: str) -> str:
    """Make an OBJ file use our material, and no other, from a material library beside it.

    Faces with materials of their own would not show the texture.
    """
    lines = [
        line
        for line in text.splitlines(keepends=True)
        if line.split()[:1] not in (["usemtl"], ["mtllib"])
    ]
    return f"mtllib {library}\nusemtl {MATERIAL}\n{''.join(lines)}"


def mtl_bytes(texture_file: str) -> bytes:
    """Return the material file: a texture, and no highlight."""
    lines = [f"newmtl {MATERIAL}", "Ka 1 1 1", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    return "\n".join([*lines, f"map_Kd {texture_file}", ""]).encode("utf-8", "surrogateescape")
