"""PLY, ASCII and binary: vertices, polygons and texture coordinates among other properties.

Own code, because meshio hangs on a truncated header and refuses most valid headers, trimesh refuses
binary polygons of mixed sizes and silently reads truncated ASCII files, and plyfile takes twice the
time for ASCII. The header declares the size of the body, so sizes are compared before anything is
read.
"""

from __future__ import annotations

import re
import struct
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Indices, Real
from cembench.core.errors import MeshError
from cembench.mesh.soup import (
    Soup,
    Texture,
    columns,
    complex_of,
    damaged,
    in_single_precision,
    no_faces,
    numbers_of,
    refuse_underscores,
    shown,
    to_number,
    unreadable,
)

#: A header must end within this many bytes.
_LONGEST_HEADER = 1 << 20
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
#: Property names of texture coordinates at vertices.
_TEXTURE = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class _Property:
    """A number, or a list if `size` is given: a number of that type is the length."""

    name: str
    item: np.dtype[Any]
    size: np.dtype[Any] | None = None

    @property
    def least_bytes(self) -> int:
        return (self.size or self.item).itemsize


@dataclass(frozen=True)
class _Element:
    """Rows with the same properties."""

    name: str
    count: int
    properties: list[_Property]

    @property
    def least_bytes(self) -> int:
        return self.count * sum(p.least_bytes for p in self.properties)

    def index(self, names: tuple[str, ...], *, of_list: bool) -> int:
        """Return the index of the property that has one of these names."""
        for k, p in enumerate(self.properties):
            if p.name in names and (p.size is not None) == of_list:
                return k
        present = ", ".join(p.name for p in self.properties) or "none"
        kind = "list" if of_list else "number"
        raise damaged(
            f"element {self.name!r} has no property {names[0]!r} that is a {kind}; its properties "
            f"are: {present}"
        )


def read(path: Path, *, uv: bool = False) -> Soup:
    """Read the vertices and polygons of a PLY file; other elements and properties are skipped.

    Coordinates have the precision that the header declares, also in ASCII files. With `uv` texture
    coordinates are read, too: the vertex properties u and v, s and t or texture_u and texture_v, or
    the list texcoord of the faces.
    """
    content = np.fromfile(path, dtype=np.uint8)
    form, elements, begin, lines = _header(content[:_LONGEST_HEADER].tobytes())
    texture = _texture_properties(elements) if uv else {}
    axes = [("x",), ("y",), ("z",), *texture.get("vertex", ())]
    wanted = {"vertex": axes, "face": [_CORNERS, *texture.get("face", ())]}
    columns = _columns(content[begin:], form, elements, lines, wanted)
    vertex = _element(elements, "vertex")
    with np.errstate(over="ignore"):  # values beyond float become infinite, and are refused
        V = [
            column.items.astype(vertex.properties[k].item.newbyteorder("="))
            for k, column in zip(_indices(vertex, axes[:3]), columns["vertex"], strict=False)
        ]
    corners, *of_corners = columns["face"]
    more: dict[str, Any] = {}
    if of_corners:
        if (of_corners[0].sizes != 2 * corners.sizes).any():
            raise damaged("a face's texcoord does not have two numbers for each corner")
        more = {"uv": complex_of(of_corners[0].items), "uv_index": np.arange(corners.sizes.sum())}
    elif uv:
        more = {"uv": complex_of(np.stack([c.items for c in columns["vertex"][3:]], axis=1))}
    return Soup.from_arrays(np.stack(V, axis=1), _whole(corners.items), corners.sizes, **more)


def _texture_properties(elements: list[_Element]) -> dict[str, list[tuple[str]]]:
    """Return the properties of the vertices or of the faces that hold texture coordinates."""
    if "texcoord" in {p.name for p in _element(elements, "face").properties}:
        return {"face": [("texcoord",)]}
    names = {p.name for p in _element(elements, "vertex").properties}
    for pair in _TEXTURE:
        if set(pair) <= names:
            return {"vertex": [(name,) for name in pair]}
    raise damaged(
        "it holds no UVs: no properties u and v, s and t or texture_u and texture_v of its "
        "vertices, and no list texcoord of its faces"
    )


def write(surface: Soup, texture: Texture | None = None) -> bytes:
    """Return a little-endian PLY file: coordinates float64, texture coordinates float32.

    MeshLab accepts these only in single precision: as `s` and `t` of a vertex or, if the surface
    has seams, as `texcoord` of a face.
    """
    V, F, uv = surface.V, surface.triangles, surface.uv
    lines = ["ply", "format binary_little_endian 1.0"]
    if texture is not None and texture.file:
        lines.append(f"comment TextureFile {texture.file}")
    lines += [f"element vertex {len(V)}", *(f"property double {axis}" for axis in "xyz")]
    by_vertex = uv is not None and not surface.has_seams
    by_corner = uv is not None and surface.has_seams
    vertex, face = [("x", "<f8", 3)], [("k", "u1"), ("F", "<i4", 3)]
    if by_vertex:
        lines += ["property float s", "property float t"]
        vertex.append(("st", "<f4", 2))
    lines += [f"element face {len(F)}", "property list uchar int vertex_indices"]
    if by_corner:
        lines.append("property list uchar float texcoord")
        face += [("c", "u1"), ("st", "<f4", 6)]
    vertices, faces = np.zeros(len(V), vertex), np.zeros(len(F), face)
    vertices["x"], faces["k"], faces["F"] = V, 3, F
    if uv is not None:
        st = in_single_precision(columns(uv), "PLY's texture coordinates")
        if by_vertex:
            vertices["st"] = st
        else:
            faces["c"], faces["st"] = 6, st[surface.uv_triangles].reshape(-1, 6)
    header = "\n".join([*lines, "end_header", ""])
    return header.encode("utf-8", "surrogateescape") + vertices.tobytes() + faces.tobytes()


def _columns(
    body: Bytes,
    form: str,
    elements: list[_Element],
    header_lines: int,
    wanted: Mapping[str, Sequence[tuple[str, ...]]],
) -> dict[str, list[_Column]]:
    """Return the wanted properties of elements, by name."""
    _check_elements(elements)
    chosen = {name: _indices(_element(elements, name), wanted[name]) for name in wanted}
    stored = elements
    if form == "ascii":
        _check_lines(elements, body)
        body = _numbers(body, header_lines).view(np.uint8)
        stored = [_as_doubles(element) for element in elements]
    _check_size(stored, body, form)
    at = 0
    rows: dict[str, list[_Column]] = {}
    for element in stored:
        rows[element.name], at = _read_rows(element, body, at, chosen.get(element.name, []))
    _check_rest(elements, body[at:], form)
    return rows


def _indices(element: _Element, wanted: Sequence[tuple[str, ...]]) -> list[int]:
    """Return the positions of the wanted properties of an element."""
    of_list = element.name == "face"
    return [element.index(names, of_list=of_list) for names in wanted]


def _header(text: bytes) -> tuple[str, list[_Element], int, int]:
    """Return the format, the elements, and the bytes and lines before the body."""
    first = re.match(rb"ply[ \t]*(\r\n|\r|\n)", text)
    if not first:
        raise damaged("it cannot be read as PLY: the first line is not 'ply'")
    end_of_line = first[1]
    last = re.search(end_of_line + rb"end_header[ \t]*" + end_of_line, text)
    if not last:
        raise damaged(f"the header has no end: no line 'end_header' in {len(text)} bytes")
    lines = text[: last.start()].decode("latin-1").split(end_of_line.decode())
    form, elements = "", list[_Element]()
    for number, line in enumerate(lines[1:], 2):
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, _] if name in _BYTE_ORDERS and not form:
                form = name
            case ["element", name, count] if form and re.fullmatch("[0-9]{1,18}", count):
                elements.append(_Element(name, int(count), []))
            case ["property", "list", size, item, name] if (
                elements and item in _TYPES and _TYPES.get(size, "f")[0] != "f"
            ):
                types = (np.dtype(_BYTE_ORDERS[form] + _TYPES[t]) for t in (item, size))
                elements[-1].properties.append(_Property(name, *types))
            case ["property", item, name] if elements and item in _TYPES:
                item_type = np.dtype(_BYTE_ORDERS[form] + _TYPES[item])
                elements[-1].properties.append(_Property(name, item_type))
            case _:
                raise damaged(
                    f"line {number} of the header, {shown(line)}, is not a format, element or "
                    "property of PLY"
                )
    return form, elements, last.end(), len(lines) + 1


def _element(elements: list[_Element], name: str) -> _Element:
    """Return the element of this name."""
    for element in elements:
        if element.name == name:
            return element
    present = ", ".join(element.name for element in elements) or "none"
    if name == "face" and present == "vertex":
        raise no_faces(elements[0].count)
    raise damaged(f"there is no element {name!r}; the header declares: {present}")


def _check_elements(elements: list[_Element]) -> None:
    """Raise if polygons would be missed: triangle strips, or duplicate names."""
    names = [element.name for element in elements]
    if "tristrips" in names:
        raise MeshError("triangle strips are not supported. Export it with an element 'face'.")
    twice = [f"element {name!r}" for name in _repeated(names)]
    for element in elements:
        repeated = _repeated([p.name for p in element.properties])
        twice += [f"property {name!r} of {element.name!r}" for name in repeated]
    if twice:
        raise damaged(f"the header declares more than once: {', '.join(twice)}")


def _repeated(names: list[str]) -> list[str]:
    """Return the names that appear more than once."""
    return [name for name, count in Counter(names).items() if count > 1]


def _numbers(body: Bytes, header_lines: int) -> Real:
    """Return the numbers of a text in order."""
    numbers = numbers_of(body.tobytes())
    if numbers is not None:
        return numbers
    for number, line in enumerate(body.tobytes().decode("latin-1").splitlines(), header_lines + 1):
        try:
            for word in line.split():
                to_number(float, word)
            refuse_underscores(line.split())
        except ValueError as error:
            raise unreadable(f"line {number}", line, error) from None
    raise damaged("the body holds a word that is not a number")


def _check_lines(elements: list[_Element], body: Bytes) -> None:
    """Raise if a row without lists is longer or shorter than declared, where each row has a line.

    Numbers are read one after another, so lines that changed places would move all between them.
    """
    if not len(body):
        return
    space = body <= ord(" ")
    starts = ~space
    starts[1:] &= space[:-1]
    lines = np.flatnonzero(body[:-1] == ord("\n")) + 1
    words = np.add.reduceat(starts, np.concatenate([[0], lines]), dtype=np.int32)
    words = words[words > 0]
    if len(words) != sum(element.count for element in elements):
        return  # rows may go over several lines
    for element in elements:
        own, words = words[: element.count], words[element.count :]
        wrong = np.flatnonzero(own != len(element.properties))
        if len(wrong) and all(p.size is None for p in element.properties):
            raise damaged(
                f"{element.name!r} {wrong[0]} (counted from 0) has {own[wrong[0]]} numbers on its "
                f"line; the header declares {len(element.properties)}"
            )


def _as_doubles(element: _Element) -> _Element:
    """Return the element with all numbers as doubles, list lengths included, as text is stored."""
    double = np.dtype("f8")
    properties = [
        _Property(p.name, double, None if p.size is None else double) for p in element.properties
    ]
    return replace(element, properties=properties)


def _check_size(elements: list[_Element], body: Bytes, form: str) -> None:
    """Raise if the file is shorter than its header declares."""
    unit, what = (8, "numbers") if form == "ascii" else (1, "bytes")
    needed = sum(element.least_bytes for element in elements)
    if needed > len(body):
        raise damaged(
            f"the header declares {_counts(elements)}, which take at least {needed // unit} "
            f"{what}, but {len(body) // unit} {what} follow it"
        )


def _check_rest(elements: list[_Element], rest: Bytes, form: str) -> None:
    """Raise if the file is longer than its header declares."""
    unit, what = (8, "numbers") if form == "ascii" else (1, "bytes")
    if len(rest) if form == "ascii" else rest[:_LONGEST_HEADER].tobytes().strip():
        raise damaged(
            f"the header declares {_counts(elements)}, but {len(rest) // unit} {what} more follow "
            "them"
        )


def _counts(elements: list[_Element]) -> str:
    """Return the declared counts of elements for a message."""
    return ", ".join(f"{element.count} of {element.name!r}" for element in elements)


@dataclass(frozen=True, eq=False)
class _Column:
    """A property in all rows: the number of items of each row, and the items concatenated."""

    sizes: Indices
    items: NDArray[Any]


def _read_rows(
    element: _Element, body: Bytes, at: int, wanted: list[int]
) -> tuple[list[_Column], int]:
    """Return the wanted properties of the element at a byte, and the position after it."""
    if element.least_bytes == 0:
        return [_Column(np.empty(0, np.int64), np.empty(0)) for _ in wanted], at
    row = _row_like_the_first(element, body, at)
    end = at + element.count * row.itemsize
    if end > len(body):
        return _walk_rows(element, body, at, wanted)
    rows = np.frombuffer(body, row, element.count, at)
    lists = [k for k, p in enumerate(element.properties) if p.size is not None]
    if any((rows[f"size {k}"] != rows[f"size {k}"][0]).any() for k in lists):
        return _walk_rows(element, body, at, wanted)
    columns = [rows[f"items {k}"].reshape(element.count, -1) for k in wanted]
    return [_Column(np.full(element.count, c.shape[1]), c.ravel()) for c in columns], end


def _row_like_the_first(element: _Element, body: Bytes, at: int) -> np.dtype[Any]:
    """Return the layout of all rows, if their lists are as long as in the first row."""
    everything = list(range(len(element.properties)))
    first, _ = _walk_rows(replace(element, count=1), body, at, everything)
    fields: list[Any] = []
    for k, (p, column) in enumerate(zip(element.properties, first, strict=True)):
        if p.size is not None:
            fields.append((f"size {k}", p.size))
        fields.append((f"items {k}", p.item, (int(column.sizes[0]),)))
    return np.dtype(fields)


def _walk_rows(
    element: _Element, body: Bytes, at: int, wanted: list[int]
) -> tuple[list[_Column], int]:
    """Return the result of :func:`_read_rows` row by row, for lists of any length."""
    starts = {k: array("q") for k in wanted}
    sizes = {k: array("q") for k in wanted}
    steps = [
        (k, p.item.itemsize, p.least_bytes, None if p.size is None else _struct(p.size).unpack_from)
        for k, p in enumerate(element.properties)
    ]
    end = len(body)
    for row in range(element.count):
        for k, item_bytes, least_bytes, unpack in steps:
            size = 1
            if at + least_bytes > end:
                raise _ends_within(element, row)
            if unpack is not None:
                (count,) = unpack(body.data, at)
                at += least_bytes
                size = int(count) if 0 <= count <= end else -1
                if size < 0 or size != count:
                    raise damaged(
                        f"list {element.properties[k].name!r} of {element.name!r} {row} (counted "
                        f"from 0) declares {count} items"
                    )
            if k in starts:
                starts[k].append(at)
                sizes[k].append(size)
            at += size * item_bytes
        if at > end:
            raise _ends_within(element, row)
    return [
        _Column(np.asarray(sizes[k]), _items(body, starts[k], sizes[k], element.properties[k].item))
        for k in wanted
    ], at


def _struct(number: np.dtype[Any]) -> struct.Struct:
    """Return the layout of a number for the module struct."""
    order = "=" if number.byteorder == "|" else number.byteorder
    return struct.Struct(order + np.dtype(number.str[1:]).char.replace("l", "q").replace("L", "Q"))


def _items(
    body: Bytes, starts: Sequence[int], sizes: Sequence[int], item: np.dtype[Any]
) -> NDArray[Any]:
    """Return the items of the lists at these positions, concatenated."""
    begin, count = np.asarray(starts), np.asarray(sizes)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    # A view of the items that begin at each byte; they may overlap.
    at_each_byte = np.ndarray(max(0, len(body) - item.itemsize + 1), item, body, strides=(1,))
    return at_each_byte[np.repeat(begin, count) + within * item.itemsize]


def _ends_within(element: _Element, row: int) -> MeshError:
    """Return the error for a file that ends within a row."""
    return damaged(
        f"the header declares {element.count} of {element.name!r}, but the file ends within "
        f"{element.name!r} {row} (counted from 0)"
    )


def _whole(indices: NDArray[Any]) -> Indices:
    """Return indices as integers; whole numbers in floating point are accepted."""
    if indices.dtype.kind != "f":
        return indices.astype(np.int64)
    bad = np.flatnonzero(~(np.abs(indices) < 2**53) | (indices != np.rint(indices)))
    if len(bad):
        raise damaged(f"vertex index {indices[bad[0]]} is not a whole number")
    return indices.astype(np.int64)
