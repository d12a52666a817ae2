"""MATLAB files of versions 5 to 7.2: v (n, 3) and f (m, 3) counted from 1, or two arrays that fit.

UVs are the array `uv`, and `fuv` at corners, counted from 1.

Own code, because scipy's reader crashes the process on some damaged files and never ends on some of
version 4. Here every length is compared with the available bytes before anything is read.
"""

from __future__ import annotations

import math
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError
from cembench.core.loading import check_room
from cembench.mesh.formats.arrays import COPIES, UV_ARRAYS, soup_of_arrays, soup_of_uv
from cembench.mesh.soup import Soup, damaged

_HEADER_BYTES = 128
#: Element types that hold numbers, and those of an array and of a compressed array.
_NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_ARRAY, _COMPRESSED = 14, 15
#: Array classes that hold numbers, and the flag of complex arrays.
_NUMERIC_CLASSES, _COMPLEX = range(6, 16), 0x0800
#: Bytes of a compressed array that are enough to read its name, to decide on the rest.
_BEGINNING = 4096


def read(path: Path, arrays: tuple[str, str] | None = None, *, uv: bool = False) -> Soup:
    """Read the vertices and triangles of a MATLAB file: v and f, the named two, or two that fit.

    With `uv` only UVs are read.
    """
    content = path.read_bytes()
    names: list[str] = []
    wanted = UV_ARRAYS if uv else arrays or ("v", "f")

    def is_wanted(name: str, shape: list[int]) -> bool:
        names.append(name)
        return name in wanted

    if uv:
        return soup_of_uv(_arrays(content, is_wanted), names, 1)
    columns = _columns(content, is_wanted)
    if not arrays and not {"v", "f"} <= set(columns):
        columns |= _columns(content, lambda name, shape: shape[1:] in ([2], [3]))
    return soup_of_arrays(columns, arrays, 1, names)


def _columns(
    content: bytes, is_wanted: Callable[[str, list[int]], bool]
) -> dict[str, NDArray[Any]]:
    """Return the wanted arrays by name, which must be real numbers (rows, 3) or (rows, 2)."""
    arrays = _arrays(content, is_wanted)
    for name, array in arrays.items():
        numeric = array.dtype.kind in "fiu"
        if not numeric or array.ndim != 2 or array.shape[1] not in (2, 3):
            raise MeshError(
                f"variable {name!r} must be real numbers of shape (rows, 3); it has shape "
                f"{array.shape} and is {'numeric' if numeric else 'not real numbers'}."
            )
    return arrays


def _arrays(content: bytes, is_wanted: Callable[[str, list[int]], bool]) -> dict[str, NDArray[Any]]:
    """Return the wanted arrays by name, and check the lengths of all others.

    `is_wanted` receives an array's name, and its shape if it holds real numbers. What is no array
    of numbers comes back empty, with its shape, as dtype "V1".

    Raises
    ------
    MeshError
        The file is damaged, or of another version.
    TooLargeError
        Memory cannot hold the wanted arrays.

    """
    order = _byte_order(content)
    arrays: dict[str, NDArray[Any]] = {}
    unpacked = 0
    for kind, element in _elements(content[_HEADER_BYTES:], order):
        begin, size = element, 0
        if kind == _COMPRESSED:
            begin, _ = _inflated(element, _BEGINNING)
            kind, size = _two_numbers(begin, 0, order)
            begin = begin[8:]
        if kind != _ARRAY:
            raise damaged(
                f"it cannot be read as MAT: an element of type {kind} where an array is expected"
            )
        name, shape, flags = _head(_elements(begin, order), order)
        if is_wanted(name, shape if _is_numeric(flags) else []) and name not in arrays:
            unpacked += size or len(element)
            check_room(f"variable {name!r} with those before it", unpacked, COPIES)
            whole = element if begin is element else _inflated_whole(element, size + 8)[8:]
            arrays[name] = _matrix(whole, order)
        elif begin is not element:
            _check_compressed(element, size + 8)
        else:  # check it all the same: damage there suggests more damage elsewhere
            deque(_elements(element, order), maxlen=0)
    return arrays


def _byte_order(content: bytes) -> str:
    """Return numpy's symbol for the byte order of a version 5 file."""
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER_BYTES], "")
    version = np.frombuffer(content, f"{order}u2", 1, 124)[0] if order else 0
    if version == 0x0100:
        return order
    if version == 0x0200 or (len(content) >= 20 and 0 in content[:4]):
        raise MeshError(
            f"MATLAB files of version {'7.3' if version else '4'} are not supported. In MATLAB, "
            "save it with save(..., '-v7')."
        )
    raise damaged("it cannot be read as MAT: it does not have the header of versions 5 to 7.2")


def _elements(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield the type and content of each data element."""
    at = 0
    while at < len(content):
        kind, size = _two_numbers(content, at, order)
        begin = at + 8
        if kind >> 16:  # a small element is stored within its own head
            kind, size, begin = kind & 0xFFFF, kind >> 16, at + 4
            if size > 4:
                raise damaged(f"it cannot be read as MAT: a short element of {size} bytes")
        at = begin + size + (0 if kind == _COMPRESSED else -(begin + size) % 8)
        if begin + size > len(content):
            raise damaged(
                f"it cannot be read as MAT: an element of {size} bytes is declared, but "
                f"{len(content) - begin} follow"
            )
        yield kind, content[begin : begin + size]


def _two_numbers(content: bytes, at: int, order: str) -> tuple[int, int]:
    """Return the two 32-bit numbers at a position."""
    if at + 8 > len(content):
        raise damaged("it cannot be read as MAT: it ends within the header of an element")
    first, second = np.frombuffer(content, f"{order}u4", 2, at).tolist()
    return first, second


def _inflated(element: bytes, most: int) -> tuple[bytes, bool]:
    """Return at most this many bytes of a compressed element, and whether it ends there."""
    stream = zlib.decompressobj()
    try:
        return stream.decompress(element, most), stream.eof
    except zlib.error:
        raise damaged("it cannot be read as MAT: damaged compression") from None


def _inflated_whole(element: bytes, size: int) -> bytes:
    """Return all bytes of a compressed element, whose size and checksum are verified."""
    content, ends = _inflated(element, size + 1)
    if len(content) != size or not ends:
        raise damaged(
            f"it cannot be read as MAT: a compressed element of {size} bytes holds "
            f"{len(content)}, or was cut short"
        )
    return content


def _check_compressed(element: bytes, size: int) -> None:
    """Raise if an unwanted element is damaged, since the file may be damaged elsewhere too."""
    stream, rest, length = zlib.decompressobj(), element, 0
    while rest and length <= size:
        try:
            length += len(stream.decompress(rest, 2**20))
        except zlib.error:
            raise damaged("it cannot be read as MAT: damaged compression") from None
        rest = stream.unconsumed_tail
    if length != size or not stream.eof:
        raise damaged("it cannot be read as MAT: a compressed element was cut short")


def _numbers(part: tuple[int, bytes], order: str) -> NDArray[Any]:
    """Return the numbers of an element."""
    kind, content = part
    if kind not in _NUMBERS or len(content) % int(_NUMBERS[kind][1:]):
        raise damaged(
            f"it cannot be read as MAT: {len(content)} bytes of type {kind} are not numbers"
        )
    return np.frombuffer(content, order + _NUMBERS[kind])


def _head(parts: Iterator[tuple[int, bytes]], order: str) -> tuple[str, list[int], int]:
    """Return the name and shape of an array, and the number that holds its class and flags."""
    flags, shape, name = (_numbers(next(parts, (0, b"")), order) for _ in range(3))
    if not len(flags):
        raise damaged("it cannot be read as MAT: an array has no class")
    return name.tobytes().decode("latin-1"), shape.tolist(), int(flags[0])


def _is_numeric(flags: int) -> bool:
    """Whether an array's class is one of real numbers."""
    return flags & 0xFF in _NUMERIC_CLASSES and not flags & _COMPLEX


def _matrix(content: bytes, order: str) -> NDArray[Any]:
    """Return an array of numbers; in place of any other, one of its shape that holds nothing."""
    parts = _elements(content, order)
    name, shape, flags = _head(parts, order)
    if flags & 0xFF not in _NUMERIC_CLASSES:
        return np.broadcast_to(np.zeros(1, "V1"), [max(0, side) for side in shape])
    numbers = _numbers(next(parts, (0, b"")), order)
    if flags & _COMPLEX:
        numbers = numbers + 1j * _numbers(next(parts, (0, b"")), order)
    if len(numbers) != math.prod(shape):
        raise damaged(
            f"variable {name!r} declares the shape {tuple(shape)}, but {len(numbers)} numbers "
            "follow"
        )
    return numbers.reshape(shape, order="F")
