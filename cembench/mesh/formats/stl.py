"""STL, binary and ASCII: triangles whose corners are merged if they coincide exactly.

Own code, because meshio and trimesh read a truncated file as an empty one, and meshio refuses
upper-case ASCII.
"""

from __future__ import annotations

from array import array
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.soup import (
    BYTE_ORDER_MARK,
    Soup,
    damaged,
    in_single_precision,
    refuse_underscores,
    shown,
    unreadable,
    words_of,
)

_HEADER_BYTES = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
#: The keywords that start the lines of an ASCII file, and their successors.
_FACET = ("facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet")


def read(path: Path) -> Soup:
    """Read the triangles of an STL file; vertices are in the order of their first use."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
    declared = int.from_bytes(head[80:], "little")
    if len(head) == _HEADER_BYTES and size == _HEADER_BYTES + declared * _TRIANGLE.itemsize:
        triangles = np.fromfile(path, _TRIANGLE, declared, offset=_HEADER_BYTES)
        return _merged(triangles["corners"])
    begin = head.decode("latin-1").removeprefix(BYTE_ORDER_MARK).lstrip()
    # Binary files may begin like this too, but contain zero bytes, e.g. in their count.
    if begin[:5].lower() == "solid" and "\0" not in begin:
        return _read_ascii(path)
    if len(head) < _HEADER_BYTES:
        raise damaged(f"it cannot be read as STL: {size} bytes, shorter than a header")
    whole, rest = divmod(size - _HEADER_BYTES, _TRIANGLE.itemsize)
    raise damaged(
        f"{declared} triangles are declared, but the file holds {whole}"
        + (f" and {rest} bytes more" if rest else "")
    )


def _read_ascii(path: Path) -> Soup:
    """Read complete facets of complete solids."""
    coordinates = array("d")
    in_solid, step = False, 0
    with path.open(encoding="latin-1") as file:
        for number, line in enumerate(file, 1):
            words = words_of(line.lower())
            if not words:
                continue
            expected = _FACET[step] if in_solid else "solid"
            if words[0].removeprefix(BYTE_ORDER_MARK) == expected:
                if expected == "vertex":
                    coordinates.extend(_point(number, line, words[1:]))
                step = (step + 1) % len(_FACET) if in_solid else 0
                in_solid = True
            elif words[0] == "endsolid" and in_solid and step == 0:
                in_solid = False
            else:
                also = " or 'endsolid'" if in_solid and step == 0 else ""
                raise damaged(f"line {number}, {shown(line)}: expected is {expected!r}{also}")
    if in_solid:
        raise damaged(
            f"the file ends within a solid, after {len(coordinates) // 9} whole triangles: no "
            "'endsolid'"
        )
    return _merged(np.asarray(coordinates))


def _point(number: int, line: str, words: list[str]) -> list[float]:
    """Return the three coordinates of a vertex line."""
    try:
        refuse_underscores(words)
        x, y, z = map(float, words)
    except ValueError:
        error = ValueError("a vertex needs 3 numbers")
        raise unreadable(f"line {number}", line.strip(), error) from None
    return [x, y, z]


def _merged(corners: NDArray[Any]) -> Soup:
    """Return the soup of triangle corners, with coinciding corners merged."""
    points = corners.reshape(-1, 3)
    order = np.lexsort(points.T)  # stable sort, so a point's first corner comes first
    ordered = points[order]
    is_new = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))[: len(points)]
    first = order[is_new]
    rank = np.argsort(np.argsort(first))
    F = np.empty(len(points), dtype=np.int64)
    F[order] = rank[np.cumsum(is_new) - 1]
    return Soup.from_arrays(points[np.sort(first)], F, np.full(len(points) // 3, 3))


def write(surface: Soup) -> bytes:
    """Return a binary STL file of separate triangles, with the normal of each."""
    P = surface.V[surface.triangles]
    facets = np.zeros(len(P), _TRIANGLE)
    size = float(np.abs(P).max(initial=0.0)) or 1.0
    normals = np.cross((P[:, 1] - P[:, 0]) / size, (P[:, 2] - P[:, 0]) / size)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["normal"] = normals / np.where(length > 0, length, 1.0)
    facets["corners"] = in_single_precision(P, "STL")
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
