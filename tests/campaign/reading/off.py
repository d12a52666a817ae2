"""Geomview's OFF, in text."""

from __future__ import annotations

import re

from tests.campaign.reading.content import Content, Damaged, integer, real, unread

_KEYWORD = re.compile(r"(ST)?C?N?OFF")


def read_off(data: bytes) -> Content:
    """Read an OFF file, a vertex and a face a line.

    The word OFF and the number of edges may be missing. Lenient: numbers after the third of a
    vertex and after the corners of a face (colours) need only be numbers.
    """
    text = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    lines = []
    for line in re.split(r"\r\n|\r|\n", text):
        words = re.split(r"[ \t\v\f]+", line.partition("#")[0].strip(" \t\v\f"))
        if words != [""]:
            lines.append(words)
    keyword = ""
    if lines and _KEYWORD.fullmatch(lines[0][0]):
        keyword = lines[0].pop(0)
        if not lines[0]:
            lines.pop(0)
    if not lines or len(lines[0]) < 2:
        raise Damaged("the counts are missing")
    vertices, faces = (integer(word) for word in lines.pop(0)[:2])
    if vertices < 0 or faces < 0:
        raise Damaged("a negative count")
    if len(lines) != vertices + faces:
        raise Damaged(f"{len(lines)} lines for {vertices} vertices and {faces} faces")
    least = 3 + 2 * ("ST" in keyword) + 3 * ("N" in keyword)
    points = []
    for words in lines[:vertices]:
        if len(words) < least:
            raise Damaged(f"a vertex with {len(words)} numbers")
        points.append(tuple(real(word) for word in words[:3]))
        for word in words[3:]:
            unread(word)
    return Content(points, [_face(words) for words in lines[vertices:]]).checked(lines=True)


def _face(words: list[str]) -> tuple[int, ...]:
    corners = integer(words[0])
    if corners < 0 or len(words) < 1 + corners:
        raise Damaged(f"a face of {corners} corners on a line of {len(words)} numbers")
    for word in words[1 + corners :]:
        unread(word)
    return tuple(integer(word) for word in words[1 : 1 + corners])
