"""Small legal mesh files of every format, with what real exporters write besides the mesh.

Everything is drawn from the generator that a function is given, so a case is known by its seed.
"""

from __future__ import annotations

import io
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.io import savemat

Points = list[tuple[float, float, float]]
Polygons = list[tuple[int, ...]]


@dataclass(frozen=True)
class SeedFile:
    """A legal file: its bytes, and the suffix of its name."""

    data: bytes
    suffix: str


def seed_file(family: str, rng: random.Random) -> SeedFile:
    """Write a random small mesh in a format of :data:`FAMILIES`."""
    points, polygons = _shape(rng)
    return FAMILIES[family](points, polygons, rng)


def _shape(rng: random.Random) -> tuple[Points, Polygons]:
    rows, columns = rng.randint(1, 5), rng.randint(1, 5)
    kind = rng.choice(("disk", "disk", "quads", "mixed", "holed", "closed"))
    if kind == "holed":
        rows, columns = max(rows, 3), max(columns, 3)
    points: Points = [
        (j + 0.3 * rng.random(), i + 0.3 * rng.random(), rng.uniform(-1, 1))
        for i in range(rows + 1)
        for j in range(columns + 1)
    ]
    polygons: Polygons = []
    for i in range(rows):
        for j in range(columns):
            if kind == "holed" and (i, j) == (1, 1):
                continue
            a = i * (columns + 1) + j
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            whole = kind == "quads" or (kind == "mixed" and rng.random() < 0.5)
            polygons += [(a, b, c, d)] if whole else [(a, b, c), (a, c, d)]
    if kind == "closed":
        points, polygons = _pyramid(rng)
    return points, polygons


def _pyramid(rng: random.Random) -> tuple[Points, Polygons]:
    """Return two pyramids on one base: a closed surface."""
    k = rng.randint(3, 8)
    turn = [2 * np.pi * i / k for i in range(k)]
    points: Points = [(float(np.cos(t)), float(np.sin(t)), 0.1 * rng.random()) for t in turn]
    points += [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    return points, [
        face for i in range(k) for face in ((i, (i + 1) % k, k), ((i + 1) % k, i, k + 1))
    ]


def _obj(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
    gap = rng.choice((" ", " ", "\t", "  "))
    corner = rng.choice(("{0}", "{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "{r}"))
    colour = gap + gap.join(("0.5", "0.25", "1")) if rng.random() < 0.2 else ""
    lines = ["# made for a test", "mtllib none.mtl"] if rng.random() < 0.5 else []
    lines += [f"v{gap}{gap.join(map(repr, p))}{colour}" for p in points]
    if corner.count("/"):
        lines += [f"vt{gap}{k}{gap}0.5" for k in range(len(points))]
        lines += [f"vn{gap}0{gap}0{gap}1" for _ in points]
    for number, face in enumerate(polygons):
        if rng.random() < 0.1:
            lines.append(rng.choice(("", "g part", "o thing", "usemtl skin", "s 1", "# f 1 1 1")))
        words = [corner.format(i + 1, r=i - len(points)) for i in face]
        line = f"f{gap}{gap.join(words)}"
        if rng.random() < 0.1:
            line += rng.choice((" ", "\t", f" # face {number}", "  # the end"))
        if rng.random() < 0.05:
            line = line.replace(words[1], words[1] + " \\\n ", 1)
        lines.append(line)
    return SeedFile(_joined(lines, rng), ".obj")


def _off(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
    coloured = rng.random() < 0.15
    lines = ["COFF" if coloured else "OFF"]
    if rng.random() < 0.3:
        lines.append("# made for a test")
    lines.append(f"{len(points)} {len(polygons)} {rng.choice((0, len(polygons)))}")
    lines += [" ".join(map(repr, p)) + (" 0.5 0.5 1 1" if coloured else "") for p in points]
    paint = " 255 0 10" if rng.random() < 0.2 else ""
    lines += [f"{len(face)} {' '.join(map(str, face))}{paint}" for face in polygons]
    if rng.random() < 0.2:
        lines.insert(rng.randint(1, len(lines)), "")
    return SeedFile(_joined(lines, rng), ".off")


def _joined(lines: list[str], rng: random.Random) -> bytes:
    ending = rng.choice(("\n", "\n", "\n", "\r\n"))
    return (ending.join(lines).replace("\\\n", "\\" + ending) + rng.choice((ending, ""))).encode()


def _stl_text(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
    lines = [rng.choice(("solid", "solid part one"))]
    for face in _triangles(polygons):
        lines += ["  facet normal 0 0 1", "    outer loop"]
        lines += ["      vertex " + " ".join(map(_single, points[k])) for k in face]
        lines += ["    endloop", "  endfacet"]
    lines += ["endsolid"]
    return SeedFile(_joined(lines, rng), ".stl")


def _single(value: float) -> str:
    return repr(float(np.float32(value)))


def _stl_binary(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
    faces = _triangles(polygons)
    header = rng.choice((b"", b"made for a test", b"solid in name only")).ljust(80, b" ")
    body = b"".join(
        struct.pack("<12fH", 0, 0, 1, *(x for k in face for x in points[k]), 0) for face in faces
    )
    return SeedFile(header + struct.pack("<I", len(faces)) + body, ".stl")


def _triangles(polygons: Polygons) -> Polygons:
    return [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]


def _mat(form: str, *, compressed: bool) -> Callable[[Points, Polygons, random.Random], SeedFile]:
    def write(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
        file = io.BytesIO()
        kind = rng.choice((float, float, np.int32, np.uint16))
        variables = {"v": np.array(points), "f": np.array(_triangles(polygons), kind) + kind(1)}
        if rng.random() < 0.3:
            variables = {"note": np.array([[1.0, 2.0]]), **variables}
        if rng.random() < 0.3:
            variables["w"] = np.eye(2)
        savemat(file, variables, format=form, do_compression=compressed)
        return SeedFile(file.getvalue(), ".mat")

    return write


#: A property of PLY: its line in the header, and from instance number to its values.
_Property = tuple[str, Callable[[int], list[float | int]]]


def _ply(form: str) -> Callable[[Points, Polygons, random.Random], SeedFile]:
    def write(points: Points, polygons: Polygons, rng: random.Random) -> SeedFile:
        elements = _ply_elements(points, polygons, rng)
        head = ["ply", f"format {form} 1.0"]
        if rng.random() < 0.5:
            head.append(rng.choice(("comment made for a test", "obj_info none", "comment")))
        body = b""
        for name, count, properties in elements:
            head.append(f"element {name} {count}")
            head += [line for line, _ in properties]
            for k in range(count):
                values = [(line.split(), value(k)) for line, value in properties]
                body += _ply_row(form, values)
        head.append("end_header")
        return SeedFile("\n".join(head).encode() + b"\n" + body, ".ply")

    return write


def _ply_elements(
    points: Points, polygons: Polygons, rng: random.Random
) -> list[tuple[str, int, list[_Property]]]:
    real = rng.choice(("double", "double", "float", "float64", "float32"))
    vertex: list[_Property] = [
        (f"property {real} {'xyz'[c]}", lambda k, c=c: [points[k][c]])  # type: ignore[misc]
        for c in range(3)
    ]
    normal: list[_Property] = [(f"property float n{c}", lambda _: [0.5]) for c in "xyz"]
    colour: list[_Property] = [
        (f"property uchar {c}", lambda k: [k % 256]) for c in ("red", "green", "blue")
    ]
    vertex = rng.choice((vertex, vertex, normal + vertex, vertex + normal, vertex + colour))
    count, index = rng.choice(
        (
            *(("uchar", "int"), ("uchar", "int"), ("uchar", "uint"), ("uint8", "int32")),
            *(("ushort", "int"), ("int", "int"), ("uchar", "ushort"), ("char", "short")),
        )
    )
    name = rng.choice(("vertex_indices", "vertex_index"))
    corners: _Property = (
        f"property list {count} {index} {name}",
        lambda k: [len(polygons[k]), *polygons[k]],
    )
    quality: _Property = ("property float quality", lambda k: [0.25 * k])
    texture: _Property = (
        "property list uchar float texcoord",
        lambda k: [2 * len(polygons[k])] + [0.5] * (2 * len(polygons[k])),
    )
    face = rng.choice(
        (
            *([corners], [corners], [corners], [quality, corners], [corners, quality]),
            *([corners, texture], [texture, corners]),
        )
    )
    elements = [("vertex", len(points), vertex), ("face", len(polygons), face)]
    if rng.random() < 0.15:
        ends: list[_Property] = [("property int vertex1", lambda k: [k])]
        ends.append(("property int vertex2", lambda k: [k + 1]))
        elements.insert(rng.randint(1, 2), ("edge", 2, ends))
    if rng.random() < 0.1:
        elements.insert(
            rng.randint(0, 2), ("camera", 1, [("property float view", lambda _: [1.5])])
        )
    return elements


def _ply_row(form: str, values: list[tuple[list[str], list[float | int]]]) -> bytes:
    if form == "ascii":
        return (" ".join(repr(x) for _, row in values for x in row) + "\n").encode()
    order = "<" if form == "binary_little_endian" else ">"
    row = b""
    for words, numbers in values:
        kinds = [words[1]] if words[1] != "list" else [words[2]] + [words[3]] * (len(numbers) - 1)
        row += struct.pack(order + "".join(_LETTERS[kind] for kind in kinds), *numbers)
    return row


_LETTERS = {
    "char": "b",
    "uchar": "B",
    "uint8": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "int32": "i",
    "uint": "I",
    "float": "f",
    "float32": "f",
    "double": "d",
    "float64": "d",
}

FAMILIES: dict[str, Callable[[Points, Polygons, random.Random], SeedFile]] = {
    "OBJ": _obj,
    "OFF": _off,
    "PLY, text": _ply("ascii"),
    "PLY, little-endian": _ply("binary_little_endian"),
    "PLY, big-endian": _ply("binary_big_endian"),
    "STL, text": _stl_text,
    "STL, binary": _stl_binary,
    "MAT 5": _mat("5", compressed=False),
    "MAT 5, compressed": _mat("5", compressed=True),
}
