"""Wavefront OBJ."""

from __future__ import annotations

import re

from tests.campaign.reading.content import Content, Damaged, Point, integer, real


def read_obj(data: bytes) -> Content:
    """Read the vertices and faces of an OBJ file.

    Lenient: statements other than ``v`` and ``f`` are skipped; a face may name vertices that come
    after it; what follows the first slash of a corner (texture, normal) is not looked at; numbers
    after the third of a vertex (weight, colour) need only be there; a byte order mark is skipped.
    """
    text = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    text = re.sub(r"\\(\r\n|\r|\n)", " ", text)
    points: list[Point] = []
    corners: list[list[int]] = []
    for line in re.split(r"\r\n|\r|\n", text):
        words = re.split(r"[ \t\v\f]+", line.partition("#")[0].strip(" \t\v\f"))
        if words[0] == "v":
            if len(words) < 4:
                raise Damaged(f"a vertex with {len(words) - 1} coordinates")
            points.append(tuple(real(word) for word in words[1:4]))
        elif words[0] == "f":
            corners.append([_index(word, len(points)) for word in words[1:]])
    return Content(points, [tuple(face) for face in corners]).checked()


def _index(word: str, seen: int) -> int:
    """Return the index from 0: the file counts from 1, or back from the last vertex so far."""
    number = integer(word.partition("/")[0])
    if number == 0:
        raise Damaged("a corner with index 0")
    return number - 1 if number > 0 else seen + number
