"""PLY files, ASCII and binary: the vertices and polygons among any elements and properties.

Own code, because meshio hangs on a truncated header and refuses most valid headers, trimesh refuses
binary polygons of mixed sizes and silently reads truncated ASCII files, and plyfile takes twice the
time for ASCII. The header declares the size of the body, so sizes are compared before anything is
read.
"""

from __future__ import annotations

import re
import struct
import warnings
from array import array
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError
from cembench.mesh.soup import Soup, damaged, shown

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
#: Type codes of the module struct.
_STRUCT = {
    "i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q",
    "f4": "f", "f8": "d",
}  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")
_AXES = (("x",), ("y",), ("z",))
_GEOMETRY: dict[str, tuple[tuple[str, ...], ...]] = {"vertex": _AXES, "face": (_CORNERS,)}
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


def read_ply(path: Path) -> Soup:
    """Read the vertices and polygons of a PLY file; other elements and properties are skipped.

    Coordinates have the precision that the header declares, also in ASCII files.
    """
    elements, found = _columns(path, _GEOMETRY)
    coordinates = _element(elements, "vertex")
    types = [coordinates.properties[k].item for k in _indices(coordinates, _GEOMETRY)]
    with np.errstate(over="ignore"):  # values beyond float become infinite, and are refused
        V = [
            column.items.astype(t.newbyteorder("="))
            for t, column in zip(types, found["vertex"], strict=True)
        ]
    (faces,) = found["face"]
    return Soup.from_arrays(np.stack(V, axis=1), _whole(faces.items), faces.sizes)


def read_ply_texture(
    path: Path,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64] | None]:
    """Read the vertices, triangles and texture coordinates of a PLY file.

    Texture coordinates are vertex properties u and v, s and t or texture_u and texture_v, or the
    list texcoord of the faces.

    Returns
    -------
    V, F : float64 (n, 3), int64 (m, 3)
        The surface.
    uv : float64 (k, 2)
        Texture coordinates.
    index : int64 (m, 3) or None
        The texture coordinate of each corner; None if they belong to the vertices.

    Raises
    ------
    MeshError
        The file is damaged, has no such property, or has polygons other than triangles.

    """
    elements = _header(np.fromfile(path, np.uint8, _LONGEST_HEADER).tobytes())[1]
    vertex = {p.name for p in _element(elements, "vertex").properties}
    face = {p.name for p in _element(elements, "face").properties}
    at_vertices = next((pair for pair in _TEXTURE if set(pair) <= vertex), None)
    at_corners = "texcoord" if "texcoord" in face else None
    if not (at_vertices or at_corners):
        raise damaged(
            "it holds no UVs: no properties u and v, s and t or texture_u and texture_v of its "
            "vertices, and no list texcoord of its faces"
        )
    more = tuple((name,) for name in at_vertices or ()) if not at_corners else ()
    lists = (("texcoord",),) if at_corners else ()
    _, found = _columns(path, {"vertex": (*_AXES, *more), "face": (_CORNERS, *lists)})
    columns = [column.items.astype(np.float64) for column in found["vertex"]]
    corners = found["face"][0]
    if (corners.sizes != 3).any():
        raise damaged("it has polygons that are not triangles")
    F = _whole(corners.items).reshape(-1, 3)
    V = np.stack(columns[:3], axis=1)
    if len(F) and not 0 <= F.min() <= F.max() < len(V):
        raise damaged(f"a triangle has vertex {int(F.max())}, but there are {len(V)}")
    if not at_corners:
        return V, F, np.stack(columns[3:], axis=1), None
    texture = found["face"][1]
    if (texture.sizes != 6).any():
        raise damaged("a triangle's texcoord does not have six numbers")
    UV = texture.items.astype(np.float64).reshape(-1, 2)
    return V, F, UV, np.arange(len(UV), dtype=np.int64).reshape(-1, 3)


def _columns(
    path: Path, wanted: Mapping[str, Sequence[tuple[str, ...]]]
) -> tuple[list[_Element], dict[str, list[_Column]]]:
    """Return the elements of a file, and the wanted properties of each, by name."""
    content = np.fromfile(path, dtype=np.uint8)
    form, elements, begin, lines = _header(content[:_LONGEST_HEADER].tobytes())
    body = content[begin:]
    _check_elements(elements)
    chosen = {name: _indices(_element(elements, name), wanted) for name in wanted}
    stored = elements
    if form == "ascii":
        body = _numbers(body, lines).view(np.uint8)
        stored = [_as_doubles(element) for element in elements]
    _check_size(stored, body, form)
    at = 0
    found: dict[str, list[_Column]] = {}
    for element in stored:
        found[element.name], at = _read_rows(element, body, at, chosen.get(element.name, []))
    _check_rest(elements, body[at:], form)
    return elements, found


def _indices(element: _Element, wanted: Mapping[str, Sequence[tuple[str, ...]]]) -> list[int]:
    """Return the positions of the wanted properties of an element."""
    of_list = element.name == "face"
    return [element.index(names, of_list=of_list) for names in wanted[element.name]]


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


def _numbers(body: Bytes, header_lines: int) -> NDArray[np.float64]:
    """Return the numbers of a text in order."""
    text = body.tobytes().strip()
    if not text:
        return np.empty(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # older versions of numpy warn instead of raising
            return np.fromstring(text, sep=" ")
    except (ValueError, DeprecationWarning):
        pass
    for number, line in enumerate(body.tobytes().decode("latin-1").splitlines(), header_lines + 1):
        for word in line.split():
            if not _is_number(word):
                raise damaged(f"line {number}, {shown(line)}: {shown(word)} is not a number")
    raise damaged("the body holds a word that is not a number")


def _is_number(word: str) -> bool:
    """Whether a word is a number in ASCII files."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


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

    sizes: NDArray[np.int64]
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
        (k, p.item.itemsize, p.least_bytes, None if p.size is None else _unpacker(p.size))
        for k, p in enumerate(element.properties)
    ]
    end = len(body)
    for row in range(element.count):
        for k, item_bytes, least_bytes, unpack in steps:
            size = 1
            if at + least_bytes > end:
                raise _ends_within(element, row)
            if unpack is not None:
                (found,) = unpack(body, at)
                at += least_bytes
                size = int(found) if 0 <= found <= end else -1
                if size < 0 or size != found:
                    raise damaged(
                        f"list {element.properties[k].name!r} of {element.name!r} {row} (counted "
                        f"from 0) declares {found} items"
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


def _unpacker(size: np.dtype[Any]) -> Callable[[Any, int], tuple[Any, ...]]:
    """Return the function that reads a list's length from bytes."""
    order = "=" if size.byteorder == "|" else size.byteorder
    return struct.Struct(order + _STRUCT[size.str[1:]]).unpack_from


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


def _whole(indices: NDArray[Any]) -> NDArray[np.int64]:
    """Return indices as integers; whole numbers in floating point are accepted."""
    if indices.dtype.kind != "f":
        return indices.astype(np.int64)
    bad = np.flatnonzero(~(np.abs(indices) < 2**53) | (indices != np.rint(indices)))
    if len(bad):
        raise damaged(f"vertex index {indices[bad[0]]} is not a whole number")
    return indices.astype(np.int64)
