"""MATLAB's MAT files of versions 4 and 5 ("Level 4" and "Level 5" in its documentation)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from itertools import islice

from tests.campaign.reading.content import Content, Damaged, finite

_TYPES = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 9: "d", 12: "q", 13: "Q"}
_MATRIX, _COMPRESSED = 14, 15
#: A matrix begins with its flags, which always have eight bytes, whatever length is said.
_FLAGS_END = 16
#: mxDOUBLE_CLASS to mxUINT64_CLASS.
_NUMERIC = range(6, 16)
_LEVEL_4 = "dfihHB"
#: Rows of values.
Table = list[tuple[float, ...]]


def read_mat(data: bytes) -> Content:
    """Read v (n, 3) and f (m, 3), corners counted from 1, or the only two variables that fit."""
    # The text that opens level 5 has no zero in its first four bytes; a number of level 4 has.
    is_level_5 = 0 not in data[:4] or data[124:128] in (b"\0\1IM", b"\1\0MI")
    by_name = _level_5(data) if is_level_5 else dict(_level_4(data))
    v, f = ("v", "f") if {"v", "f"} <= set(by_name) else _only_pair(by_name)
    points, polygons = [], []
    for row in by_name[v]:
        if len(row) != 3:
            raise Damaged(f"v has {len(row)} columns")
        points.append(tuple(finite(float(x)) for x in row))
    for row in by_name[f]:
        if len(row) != 3 or any(finite(x) != int(x) for x in row):
            raise Damaged("f does not hold whole numbers in three columns")
        polygons.append(tuple(int(x) - 1 for x in row))
    return Content(points, polygons).checked()


def _only_pair(found: dict[str, Table]) -> tuple[str, str]:
    """Return the names of the only points with triangles whose corners run from 1 to the last."""
    wide = {name: rows for name, rows in found.items() if rows and len(rows[0]) == 3}
    spans = {name: {min(map(min, rows)), max(map(max, rows))} for name, rows in wide.items()}
    pairs = [(v, f) for v in wide for f in wide if v != f and spans[f] == {1, len(wide[v])}]
    if len(pairs) != 1:
        raise Damaged("no variables v and f, and not exactly two others that fit")
    return pairs[0]


def _level_5(data: bytes) -> dict[str, Table]:
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise Damaged("neither of the two byte orders")
    (version,) = struct.unpack_from(order + "H", data, 124)
    if version != 0x0100:
        raise Damaged(f"version {version:#x}")
    whole: dict[str, Table] = {}
    lost = None
    for kind, body in _elements(data[128:], order):
        try:
            content = _decompressed(body, order) if kind == _COMPRESSED else body
        except Damaged as error:
            lost = error
            continue
        if kind in (_MATRIX, _COMPRESSED):
            whole |= dict([found]) if (found := _matrix(content, order)) else {}
    if lost and not {"v", "f"} <= set(whole):
        raise lost  # who knows which variable it was
    return whole


def _decompressed(body: bytes, order: str) -> bytes:
    try:
        inner = list(_elements(zlib.decompress(body), order))
    except zlib.error as error:
        raise Damaged(f"compressed data: {error}") from None
    if len(inner) != 1 or inner[0][0] != _MATRIX:
        raise Damaged("compressed data that is not one matrix")
    return inner[0][1]


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield type and bytes of each data element, padded to eight bytes unless compressed."""
    at = 0
    while at < len(data):
        if at + 8 > len(data):
            raise Damaged("it ends in the tag of an element")
        (word,) = struct.unpack_from(order + "I", data, at)
        if word >> 16:
            kind, size, start, step = word & 0xFFFF, word >> 16, at + 4, 8
            if size > 4:
                raise Damaged("a small element of more than four bytes")
        else:
            kind = word
            (size,) = struct.unpack_from(order + "I", data, at + 4)
            padded = size if kind == _COMPRESSED else -(-size // 8) * 8
            start, step = at + 8, 8 + padded
        if start + size > len(data):
            raise Damaged("it ends in an element")
        yield kind, data[start : start + size]
        at += step


def _matrix(data: bytes, order: str) -> tuple[str, Table] | None:
    if len(data) < _FLAGS_END:
        return None
    (flags,) = struct.unpack_from(order + "I", data, 8)
    elements = _elements(data[_FLAGS_END:], order)
    head = list(islice(elements, 2))
    if len(head) < 2 or len(head[0][1]) < 8 or head[0][0] != 5:
        return None
    name = head[1][1].decode("latin-1")
    dimensions = struct.unpack(f"{order}{len(head[0][1]) // 4}i", head[0][1])
    try:
        if flags & 0xFF not in _NUMERIC or flags & 0x0800 or len(dimensions) != 2:
            raise Damaged(f"{name} is not a matrix of real numbers")
        kind, body = next(elements, (0, b""))
        if kind not in _TYPES:
            raise Damaged(f"{name} is of an unknown type")
        return name, _table(_TYPES[kind], body, order, *dimensions, name=name)
    except Damaged:
        if name in ("v", "f"):
            raise
        return None  # nobody reads it


def _table(form: str, body: bytes, order: str, rows: int, columns: int, *, name: str) -> Table:
    """Return the rows of a matrix that is stored by columns."""
    size = struct.calcsize(order + form)
    if rows < 0 or columns < 0 or rows * columns * size != len(body):
        raise Damaged(f"{name} is {rows} by {columns} but has {len(body)} bytes")
    values = struct.unpack(f"{order}{rows * columns}{form}", body)
    return [values[k::rows] for k in range(rows)]


def _level_4(data: bytes) -> Iterator[tuple[str, Table]]:
    if len(data) < 20:
        raise Damaged("too short")
    order = "<" if struct.unpack_from("<i", data)[0] in range(5000) else ">"
    at = 0
    while at < len(data):
        if at + 20 > len(data):
            raise Damaged("it ends in a header")
        kind, rows, columns, imaginary, length = struct.unpack_from(order + "5i", data, at)
        machine, reserved, precision, matrix = (kind // 10**k % 10 for k in (3, 2, 1, 0))
        if kind < 0 or machine > 1 or reserved or precision > 5 or matrix > 2 or imaginary:
            raise Damaged("a header that is not of level 4, or not of a real matrix")
        form = _LEVEL_4[precision]
        size = struct.calcsize(order + form) * rows * columns
        if min(rows, columns, length) < 0 or at + 20 + length + size > len(data):
            raise Damaged("it ends in a matrix")
        name = data[at + 20 : at + 20 + length].rstrip(b"\0").decode("latin-1")
        at += 20 + length
        if name in ("v", "f"):
            if matrix:
                raise Damaged(f"{name} is text or sparse")
            yield name, _table(form, data[at : at + size], order, rows, columns, name=name)
        at += size
