"""PLY, in text and binary."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from tests.campaign.reading.content import Content, Damaged, finite, integer, lines_of, unread

_SIZES = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_LISTS = ("vertex_indices", "vertex_index")
Value = float | int
#: Reads one value of a type.
Take = Callable[[str], Value]


@dataclass
class _Property:
    name: str
    kind: str
    counted_by: str | None = None


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(data: bytes) -> Content:
    """Read a PLY file: all that its header declares, and nothing behind it but white space.

    In text each instance of an element is a line. Elements and properties that are neither
    coordinates nor corners are read and dropped.
    """
    form, elements, body = _header(data)
    names = [element.name for element in elements]
    if sorted(set(names)) != sorted(names):
        raise Damaged("an element is declared twice")
    if form == "ascii":
        contents = _text(elements, body)
    else:
        contents = _binary(elements, body, "<" if form == "binary_little_endian" else ">")
    if "vertex" not in contents or "face" not in contents:
        raise Damaged("no element vertex or no element face")
    points = []
    for row in contents["vertex"]:
        if not all(isinstance(row.get(name), (int, float)) for name in "xyz"):
            raise Damaged("a vertex without x, y and z")
        points.append(tuple(finite(float(row[name])) for name in "xyz"))  # type: ignore[arg-type]
    polygons = []
    for row in contents["face"]:
        corners = next((row[name] for name in _LISTS if name in row), None)
        if not isinstance(corners, tuple) or any(isinstance(k, float) for k in corners):
            raise Damaged("a face without a list of vertex indices")
        polygons.append(tuple(int(k) for k in corners))
    return Content(points, polygons).checked(lines=True)


Row = dict[str, Value | tuple[Value, ...]]


def _header(data: bytes) -> tuple[str, list[_Element], bytes]:
    first = re.match(rb"ply[ \t]*(\r\n|\r|\n)", data)
    if first is None:
        raise Damaged("it does not begin with ply")
    ending = first[1]
    form, elements, at = "", list[_Element](), first.end()
    while True:
        end = data.find(ending, at)
        if end < 0:
            raise Damaged("the header does not end")
        words = data[at:end].decode("latin-1").split()
        at = end + len(ending)
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words == ["end_header"]:
            break
        if words[0] == "format" and len(words) == 3 and not form:
            form = words[1]
        elif words[0] == "element" and len(words) == 3:
            elements.append(_Element(words[1], integer(words[2])))
        elif words[0] == "property" and elements:
            elements[-1].properties.append(_property(words))
        else:
            raise Damaged(f"{' '.join(words)[:60]!r} in the header")
    if form not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise Damaged(f"format {form[:40]!r}")
    if any(element.count < 0 for element in elements):
        raise Damaged("a negative count")
    return form, elements, data[at:]


def _property(words: list[str]) -> _Property:
    if len(words) == 5 and words[1] == "list" and words[2] in _SIZES and words[3] in _SIZES:
        if _SIZES[words[2]] in "fd":
            raise Damaged("the length of a list cannot be a fraction")
        return _Property(words[4], words[3], words[2])
    if len(words) == 3 and words[1] in _SIZES:
        return _Property(words[2], words[1])
    raise Damaged(f"{' '.join(words)[:60]!r} in the header")


def _row(properties: list[_Property], take: Take, room: Callable[[], int]) -> Row:
    """Read one instance; `room` says how many values can be left at most."""
    row: Row = {}
    for p in properties:
        if p.counted_by is None:
            value: Value | tuple[Value, ...] = take(p.kind)
        else:
            length = take(p.counted_by)
            if not isinstance(length, int) or not 0 <= length <= room():
                raise Damaged(f"a list of {length} values")
            value = tuple(take(p.kind) for _ in range(length))
        if p.name in row:
            raise Damaged(f"property {p.name} is declared twice")
        row[p.name] = value
    return row


def _text(elements: list[_Element], body: bytes) -> dict[str, list[Row]]:
    lines = lines_of(body)
    needed = sum(element.count for element in elements if element.properties)
    if len(lines) != needed:
        raise Damaged(f"{len(lines)} lines, declared are {needed}")
    found: dict[str, list[Row]] = {}
    at = iter(lines)
    for element in elements:
        found[element.name] = []
        for _ in range(element.count if element.properties else 0):
            words = next(at)
            words.reverse()

            def take(kind: str, words: list[str] = words) -> Value:
                if not words:
                    raise Damaged("a line is too short")
                value = unread(words.pop())  # who reads it wants it finite, or whole
                return int(value) if _SIZES[kind] not in "fd" and value.is_integer() else value

            def room(words: list[str] = words) -> int:
                return len(words)

            found[element.name].append(_row(element.properties, take, room))
            if words:
                raise Damaged("a line is too long")
    return found


def _binary(elements: list[_Element], body: bytes, order: str) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    at = 0

    def take(kind: str) -> Value:
        nonlocal at
        form = order + _SIZES[kind]
        try:
            (value,) = struct.unpack_from(form, body, at)
        except struct.error:
            raise Damaged("it ends too early") from None
        at += struct.calcsize(form)
        result: Value = value
        return result

    for element in elements:
        found[element.name] = []
        if element.properties and element.count > len(body):
            raise Damaged(f"{element.count} of {element.name} in {len(body)} bytes")
        for _ in range(element.count if element.properties else 0):
            found[element.name].append(_row(element.properties, take, lambda: len(body) - at))
    if body[at:].strip():
        raise Damaged(f"{len(body) - at} bytes are left over")
    return found
