"""Polygons as in a file, before any check of the surface.

A :class:`Soup` may have isolated vertices, NaN coordinates, and edges with any number of polygons.
:func:`~cembench.mesh.files.read_mesh` checks it; repairs start from it; writers take it. A file
whose content does not match its declarations never becomes a soup: its reader raises
:func:`damaged`.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.arrays import Complex, Indices, Points
from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.polygons import triangulate

#: Marks a corner without texture coordinates.
NO_UV = -1
#: Characters that `str.split` treats as space but no mesh format does.
_NOT_SPACES = dict.fromkeys(map(ord, "\x1c\x1d\x1e\x1f\x85\xa0"), "\0")

#: A number as many European programs write it.
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
#: The byte order mark of UTF-8, decoded as Latin-1.
BYTE_ORDER_MARK = b"\xef\xbb\xbf".decode("latin-1")


@dataclass(frozen=True, eq=False)
class Soup:
    """Vertices, polygons and texture coordinates; only the polygons' indices are checked.

    A file of texture coordinates alone has no vertices, and its polygons have sizes but no corners.

    Parameters
    ----------
    V : float64 (n, 3)
        All vertices, in the file's order.
    corners : int64 (sum of sizes,)
        Vertex indices, 0 to n - 1, of all polygons in the file's order, concatenated.
    sizes : int64 (k,)
        Number of corners of each polygon, at least 3.
    name : str
        Name in reports: the file's stem.
    notices : tuple of Notice
        What was changed or ignored while reading the file.
    uv : complex128 (l,), optional
        Texture coordinates; v points up.
    uv_index : int64 (sum of sizes,), optional
        The texture coordinate of each corner, :data:`NO_UV` for none (default: that of its vertex).
    """

    V: Points
    corners: Indices
    sizes: Indices
    name: str = "mesh"
    notices: tuple[Notice, ...] = ()
    uv: Complex | None = None
    uv_index: Indices | None = None

    @classmethod
    def of_triangles(
        cls,
        V: Points,
        F: Indices,
        uv: Complex | None = None,
        uv_index: Indices | None = None,
        **more: Any,
    ) -> Self:
        """Return a soup of triangles F (m, 3); `uv_index` is (m, 3), too. Nothing is checked."""
        index = None if uv_index is None else uv_index.ravel()
        return cls(V, F.ravel(), np.full(len(F), 3), uv=uv, uv_index=index, **more)

    @classmethod
    def from_arrays(
        cls,
        V: ArrayLike,
        corners: ArrayLike,
        sizes: ArrayLike,
        *,
        counted_from: int = 0,
        **more: Any,
    ) -> Self:
        """Return a soup after checking that the vertices of its polygons exist.

        The file counts vertices from `counted_from`, and so do the messages.

        Raises
        ------
        MeshError
            A polygon has fewer than three corners, an index is out of range, or there is neither a
            polygon nor a texture coordinate.
        """
        V = np.asarray(V, dtype=np.float64).reshape(-1, 3)
        places: Indices = np.asarray(corners, dtype=np.int64).ravel() - counted_from
        counts: Indices = np.asarray(sizes, dtype=np.int64)
        if not len(counts) and more.get("uv") is None:
            raise no_faces(len(V))
        lines = np.flatnonzero(counts == 2)
        if 0 < len(lines) < len(counts) and more.get("uv") is None:
            of_line = np.repeat(counts == 2, counts)
            places, counts = places[~of_line], np.delete(counts, lines)
            text = f"{len(lines):,} faces with two corners, which are lines, were ignored"
            notices = (*more.get("notices", ()), Notice(NoticeKind.LINES_IGNORED, text))
            more = {**more, "notices": notices}
        small = np.flatnonzero(counts < 3)
        if len(small):
            raise damaged(
                f"face {small[0]} (counted from 0) has {counts[small[0]]} corners; at least 3 are "
                "needed"
            )
        bad = np.flatnonzero((places < 0) | (places >= len(V)))
        if len(bad):
            face = np.searchsorted(np.cumsum(counts), bad[0], side="right")
            raise damaged(
                f"face {face} (counted from 0) has a vertex index out of range, "
                f"{places[bad[0]] + counted_from}; allowed is {counted_from} to "
                f"{len(V) - 1 + counted_from}"
            )
        return cls(V, places, counts, **more)

    def named(self, name: str) -> Self:
        """Return the same soup under another name."""
        return replace(self, name=name)

    def subset(self, first: int, last: int) -> Self:
        """Return the polygons from `first` to `last`, counted from 0, with their vertices only.

        Raises
        ------
        MeshError
            There are no such polygons.
        """
        if not 0 <= first <= last < len(self.sizes):
            raise MeshError(
                f"polygons {first} to {last} were asked for; it has {len(self.sizes)}, counted "
                "from 0."
            )
        ends = np.cumsum(self.sizes)
        corners = self.corners[ends[first] - self.sizes[first] : ends[last]]
        used, corners = np.unique(corners, return_inverse=True)
        return replace(self, V=self.V[used], corners=corners, sizes=self.sizes[first : last + 1])

    def without_isolated(self) -> tuple[Self, Indices]:
        """Return the soup without vertices in no polygon, and the numbers of the others."""
        used, corners = np.unique(self.corners, return_inverse=True)
        if len(used) == len(self.V):
            return self, used
        first = int(np.setdiff1d(np.arange(len(self.V)), used)[0])
        text = (
            f"{len(self.V) - len(used):,} vertices in no triangle were left out, the first being "
            f"{first} (counted from 0)"
        )
        notices = (*self.notices, Notice(NoticeKind.ISOLATED_LEFT_OUT, text))
        return replace(self, V=self.V[used], corners=corners.reshape(-1), notices=notices), used

    @property
    def triangles(self) -> Indices:
        """Return the polygons cut into triangles, (m, 3), in order."""
        return self.corners[self._places]

    @property
    def uv_triangles(self) -> Indices:
        """Return the texture coordinate of each corner of the triangles, (m, 3)."""
        return (self.corners if self.uv_index is None else self.uv_index)[self._places]

    @cached_property
    def _places(self) -> Indices:
        """The corners of the triangles, (m, 3), as places in `corners`."""
        return triangulate(self.V, self.corners, self.sizes)

    @property
    def has_seams(self) -> bool:
        """Whether the corners at some vertex have different texture coordinates."""
        return self.uv_index is not None and not np.array_equal(self.uv_index, self.corners)

    def cut_at_seams(self) -> Self:
        """Return the same triangles with one vertex for each texture coordinate of a vertex.

        The original vertex keeps the texture coordinate of its first triangle; copies come last.
        """
        if self.uv is None or self.uv_index is None:
            return self
        pairs = np.stack([self.triangles.ravel(), self.uv_triangles.ravel()], axis=1)
        distinct, inverse = np.unique(pairs, axis=0, return_inverse=True)
        order = np.lexsort((distinct[:, 0], distinct[:, 1]))
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        vertex, texture = distinct[order].T
        F = place[inverse.ravel()].reshape(-1, 3)
        return self.of_triangles(self.V[vertex], F, self.uv[texture], name=self.name)

    def normals(self) -> Points:
        """Return unit normals at the vertices of the triangles, averaged by area, (n, 3)."""
        F = self.triangles
        a, b, c = (self.V[F[:, k]] for k in range(3))
        size = float(np.abs(self.V).max()) or 1.0  # to avoid overflow of squares
        faces = np.cross((b - a) / size, (c - a) / size)
        total = np.zeros_like(self.V)
        for k in range(3):
            for axis in range(3):
                total[:, axis] += np.bincount(F[:, k], faces[:, axis], len(self.V))
        length = np.linalg.norm(total, axis=1, keepdims=True)
        up = np.array([0.0, 0.0, 1.0])
        return np.where(length > 0, total / np.where(length > 0, length, 1.0), up)


@dataclass(frozen=True)
class Texture:
    """The texture image of a surface, as a PNG file, and the name of that file beside it."""

    png: bytes
    file: str = ""


def columns(uv: Complex) -> Points:
    """Return complex numbers as two columns, (k, 2)."""
    return np.stack([uv.real, uv.imag], axis=1)


def complex_of(uv: ArrayLike) -> Complex:
    """Return two columns of real numbers as complex numbers."""
    return np.ascontiguousarray(uv, dtype=np.float64).reshape(-1, 2).view(np.complex128).ravel()


def in_single_precision(points: Points, format_name: str) -> NDArray[np.float32]:
    """Return points as float32, little-endian.

    Raises
    ------
    MeshError
        The coordinates are too large for single precision.
    """
    largest = float(np.finfo(np.float32).max)
    if np.abs(points).max(initial=0.0) > largest:
        raise MeshError(
            f"coordinates up to {np.abs(points).max():.3g} are too large for {format_name}, which "
            f"holds numbers up to {largest:.3g}; scale the surface, or write OBJ."
        )
    return points.astype("<f4")


def numbers_of(text: bytes, dtype: type = np.float64) -> NDArray[Any] | None:
    """Return the numbers of a text in order; None if it holds anything else."""
    if not text.strip():
        return np.empty(0, dtype)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # older versions of numpy warn instead of raising
            return np.fromstring(text.strip(), dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        return None


def words_of(line: str) -> list[str]:
    """Split a line at ASCII spaces; `str.split` would also split at Unicode separators."""
    return line.translate(_NOT_SPACES).split()


def shown(text: str, most: int = 60) -> str:
    """Return a line of a file for a message: quoted, on one line and not too long."""
    text = text.strip()
    return repr(text if len(text) <= most else text[:most] + "...")


class NotANumberError(ValueError):
    """A word of a text file is no number; the message says why."""


_N = TypeVar("_N", int, float)


def to_number(kind: type[_N], word: str) -> _N:
    """Return a word as an integer or a floating-point number.

    Raises
    ------
    NotANumberError
        It is not one.
    """
    try:
        return kind(word)
    except ValueError:
        whole = "whole " * (kind is int and _DECIMAL_COMMA.fullmatch(word) is None)
        raise NotANumberError(f"{shown(word)} is not a {whole}number") from None


def unreadable(where: str, line: str, error: Exception) -> MeshError:
    """Return the error of a line that cannot be read; decimal commas are no damage."""
    if any(_DECIMAL_COMMA.fullmatch(word) for word in line.split()):
        return MeshError(
            f"{where}, {shown(line)}: the numbers have decimal commas. Export the file with "
            "decimal points, or replace each comma by a point."
        )
    why = error if isinstance(error, ValueError) else "a number is too large"
    return damaged(f"{where}, {shown(line)}: {why}")


def refuse_underscores(fields: list[str]) -> None:
    """Raise :class:`ValueError` for numbers that only Python accepts, such as 1_000."""
    if "_" in "".join(fields):
        raise ValueError("an underscore is not part of a number")


def no_faces(n: int) -> MeshError:
    """Return the error that a file has vertices only."""
    return MeshError(
        f"no faces: {n} vertices were found, but not one triangle or polygon. The file holds a "
        "point cloud, was cut short, or is of another format than its name says; export or "
        "download it again, as a surface."
    )


@contextmanager
def reading_as(kind: str) -> Iterator[None]:
    """Turn whatever a library raises on damaged bytes, or its exit, into an error of a file."""
    try:
        yield
    except MemoryError:
        raise
    except (SystemExit, Exception):  # meshio calls sys.exit on some damaged files
        raise damaged(f"it cannot be read as {kind}") from None


def damaged(what: str) -> MeshError:
    """Return an error that says what is wrong in a file, and what to do about it."""
    return MeshError(
        f"{what}. The file is damaged, cut short, or of another format than its name says; export "
        "or download it again."
    )
