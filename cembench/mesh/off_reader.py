"""Geomview OFF files: vertices, and polygons with or without colours.

Own code, because trimesh loses the faces of a truncated file, and meshio reads only triangles
without colours.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from cembench.core.errors import MeshError
from cembench.mesh.soup import BYTE_ORDER_MARK, Soup, damaged, refuse_underscores, shown, words_of

M = TypeVar("M", int, float)
_Lines = Iterator[tuple[int, list[str]]]


def read_off(path: Path) -> Soup:
    """Read the vertices and polygons of an OFF file; colours, normals and textures are skipped."""
    coordinates, corners, sizes = array("d"), array("q"), array("q")
    with path.open(encoding="latin-1") as file:
        lines = _statements(file)
        vertices, faces = _declared(lines)
        for k in range(vertices):
            number, words = _next(lines, f"{vertices} vertices are declared, but {k} were found")
            coordinates.extend(_numbers(float, number, words, 3))
        for k in range(faces):
            number, words = _next(lines, f"{faces} faces are declared, but {k} were found")
            (size,) = _numbers(int, number, words, 1)
            try:
                corners.extend(_numbers(int, number, words[1:], max(size, 0)))
                sizes.append(size)
            except OverflowError:
                told = "a number is too large for a vertex index"
                raise damaged(f"line {number}, {shown(' '.join(words))}: {told}") from None
        for number, words in lines:
            raise damaged(
                f"{vertices} vertices and {faces} faces are declared, but the file continues at "
                "line "
                f"{number}, {shown(' '.join(words))}"
            )
    return Soup.from_arrays(coordinates, corners, sizes)


def _statements(file: Iterator[str]) -> _Lines:
    """Yield the line number and words of each line that is not only a comment."""
    for number, line in enumerate(file, 1):
        words = words_of(line.split("#", 1)[0] if "#" in line else line)
        if words:
            yield number, words


def _next(lines: _Lines, missing: str) -> tuple[int, list[str]]:
    """Return the next line; an error with the text `missing` if there is none."""
    found = next(lines, None)
    if found is None:
        raise damaged(missing)
    return found


def _declared(lines: _Lines) -> tuple[int, int]:
    """Return the declared numbers of vertices and faces; the leading word OFF is optional."""
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
    return vertices, faces


def _numbers(kind: type[M], number: int, words: list[str], count: int) -> list[M]:
    """Return the first `count` numbers of a line; the rest, e.g. a colour, must be numbers too."""
    try:
        found = [kind(word) for word in words[:count]]
        for word in words[count:]:
            float(word)
        refuse_underscores(words)
    except ValueError as error:
        raise damaged(f"line {number}, {shown(' '.join(words))}: {error}") from None
    if len(found) < count:
        raise damaged(
            f"line {number}, {shown(' '.join(words))}: {count} numbers are needed, but "
            f"{len(found)} were found"
        )
    return found
