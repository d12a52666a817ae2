"""STL, in text and binary."""

from __future__ import annotations

import struct

from tests.campaign.reading.content import Content, Damaged, Point, finite, lines_of, real


def read_stl(data: bytes) -> Content:
    """Read the triangles of an STL file; corners of equal coordinates are one vertex.

    It is binary where its size is what its count says; else text. Lenient: of text only the corners
    are read, three a facet, and it must be whole to the last ``endsolid``.
    """
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        return _joined(_binary(data))
    text = data.removeprefix(b"\xef\xbb\xbf")
    if text.lstrip()[:5].lower() != b"solid":
        raise Damaged("neither text nor of the size that its count says")
    return _joined(_text(text))


def _joined(triangles: list[tuple[Point, ...]]) -> Content:
    index: dict[Point, int] = {}
    for triangle in triangles:
        for corner in triangle:
            index.setdefault(corner, len(index))
    return Content(list(index), [tuple(index[c] for c in t) for t in triangles]).checked()


def _binary(data: bytes) -> list[tuple[Point, ...]]:
    triangles = []
    for at in range(84, len(data), 50):
        numbers = [finite(x) for x in struct.unpack_from("<9f", data, at + 12)]
        triangles.append(tuple(tuple(numbers[k : k + 3]) for k in (0, 3, 6)))
    return triangles


def _text(data: bytes) -> list[tuple[Point, ...]]:
    lines = lines_of(data)
    keywords = [words[0].lower() for words in lines]
    if keywords[-1] != "endsolid":
        raise Damaged("it does not end with endsolid")
    corners: list[Point] = []
    for keyword, words in zip(keywords, lines, strict=True):
        if keyword == "vertex":
            if len(words) != 4:
                raise Damaged(f"a vertex with {len(words) - 1} coordinates")
            corners.append(tuple(real(word) for word in words[1:]))
    facets, rest = divmod(len(corners), 3)
    declared = max(keywords.count("facet"), keywords.count("endfacet"))
    if rest or facets < declared:
        raise Damaged(f"{len(corners)} corners for {declared} facets")
    return [tuple(corners[3 * k : 3 * k + 3]) for k in range(facets)]
