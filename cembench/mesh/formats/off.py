"""Geomview OFF: vertices, polygons and texture coordinates; written without these.

Own code, because trimesh loses the faces of a truncated file, and meshio reads only triangles
without colours. Other programs do not read the texture coordinates of an STOFF file.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from cembench.core.errors import MeshError
from cembench.mesh.soup import (
    BYTE_ORDER_MARK,
    Soup,
    complex_of,
    damaged,
    refuse_underscores,
    shown,
    to_number,
    unreadable,
    words_of,
)

M = TypeVar("M", int, float)
_Lines = Iterator[tuple[int, list[str]]]


def read(path: Path, *, uv: bool = False) -> Soup:
    """Read the vertices and polygons of an OFF file; colours and normals are skipped.

    With `uv` its texture coordinates are read, too: the last two numbers of each vertex, as STOFF
    declares.
    """
    coordinates, corners, sizes = array("d"), array("q"), array("q")
    texture = array("d")
    with path.open(encoding="latin-1") as file:
        lines = _statements(file)
        vertices, faces, has_uv = _declared(lines)
        if uv and not has_uv:
            raise damaged("it holds no UVs: the first word is not STOFF")
        for k in range(vertices):
            number, words = _next(lines, f"{vertices} vertices are declared, but {k} were found")
            if uv:
                numbers = _numbers(float, number, words, max(5, len(words)))
                texture.extend(numbers[-2:])
            coordinates.extend(_numbers(float, number, words, 3))
        for k in range(faces):
            number, words = _next(lines, f"{faces} faces are declared, but {k} were found")
            (size,) = _numbers(int, number, words, 1)
            try:
                corners.extend(_numbers(int, number, words[1:], max(size, 0)))
                sizes.append(size)
            except OverflowError:
                why = "a number is too large for a vertex index"
                raise damaged(f"line {number}, {shown(' '.join(words))}: {why}") from None
        for number, words in lines:
            raise damaged(
                f"{vertices} vertices and {faces} faces are declared, but the file continues at "
                f"line {number}, {shown(' '.join(words))}"
            )
    return Soup.from_arrays(coordinates, corners, sizes, uv=complex_of(texture) if uv else None)


def write(surface: Soup) -> bytes:
    """Return an OFF file; numbers are the shortest decimals that read back unchanged."""
    F = surface.triangles
    lines = ["OFF", f"{len(surface.V)} {len(F)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in surface.V.tolist()]
    lines += [f"3 {i} {j} {k}" for i, j, k in F.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _statements(file: Iterator[str]) -> _Lines:
    """Yield the line number and words of each line that is not only a comment."""
    for number, line in enumerate(file, 1):
        words = words_of(line.split("#", 1)[0] if "#" in line else line)
        if words:
            yield number, words


def _next(lines: _Lines, missing: str) -> tuple[int, list[str]]:
    """Return the next line; an error with the text `missing` if there is none."""
    line = next(lines, None)
    if line is None:
        raise damaged(missing)
    return line


def _declared(lines: _Lines) -> tuple[int, int, bool]:
    """Return the declared numbers of vertices and faces, and whether vertices end with UVs.

    The leading word OFF is optional.
    """
    missing = "there is no line with the numbers of vertices and faces"
    number, words = _next(lines, missing)
    keyword = re.fullmatch(r"(ST)?C?N?(4?n?)OFF", words[0].removeprefix(BYTE_ORDER_MARK))
    if keyword:
        if keyword[2] or words[1:] == ["BINARY"]:
            raise MeshError(
                f"OFF files of the kind {' '.join(words)!r} are not supported; allowed are text "
                "files with three coordinates a vertex. Convert it to one of these."
            )
        words = words[1:]
        if not words:
            number, words = _next(lines, missing)
    vertices, faces = _numbers(int, number, words, 2)
    if min(vertices, faces) < 0:
        raise damaged(f"line {number}: {vertices} vertices and {faces} faces are declared")
    return vertices, faces, bool(keyword and keyword[1])


def _numbers(kind: type[M], number: int, words: list[str], count: int) -> list[M]:
    """Return the first `count` numbers of a line; the rest, e.g. a colour, must be numbers too."""
    try:
        numbers = [to_number(kind, word) for word in words[:count]]
        for word in words[count:]:
            to_number(float, word)
        refuse_underscores(words)
    except ValueError as error:
        raise unreadable(f"line {number}", " ".join(words), error) from None
    if len(numbers) < count:
        raise damaged(
            f"line {number}, {shown(' '.join(words))}: {count} numbers are needed, but "
            f"{len(numbers)} were found"
        )
    return numbers
