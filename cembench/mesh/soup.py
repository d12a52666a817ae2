"""Polygons as in a file, before any check of the surface.

A :class:`Soup` may have isolated vertices, NaN coordinates, and edges with any number of polygons.
:func:`~cembench.mesh.files.read_mesh` checks it; repairs start from it. A file whose content does
not match its declarations never becomes a soup: its reader raises :func:`damaged`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.errors import MeshError
from cembench.core.notices import Notice

#: Characters that `str.split` treats as space but no mesh format does.
_NOT_SPACES = dict.fromkeys(map(ord, "\x1c\x1d\x1e\x1f\x85\xa0"), "\0")

#: The byte order mark of UTF-8, decoded as Latin-1.
BYTE_ORDER_MARK = b"\xef\xbb\xbf".decode("latin-1")


@dataclass(frozen=True, eq=False)
class Soup:
    """Vertices and polygons; only the indices are checked.

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

    """

    V: NDArray[np.float64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    name: str = "mesh"
    notices: tuple[Notice, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        V: ArrayLike,
        corners: ArrayLike,
        sizes: ArrayLike,
        *,
        counted_from: int = 0,
        notices: tuple[Notice, ...] = (),
    ) -> Self:
        """Return a soup after checking that it has polygons and that their vertices exist.

        The file counts vertices from `counted_from`, and so do the messages.

        Raises
        ------
        MeshError
            There is no polygon, a polygon has fewer than three corners, or an index is out of
            range.

        """
        V = np.asarray(V, dtype=np.float64).reshape(-1, 3)
        corners = np.asarray(corners, dtype=np.int64).ravel() - counted_from
        sizes = np.asarray(sizes, dtype=np.int64)
        if not len(sizes):
            raise MeshError(
                f"no faces: {len(V)} vertices were found, but not one triangle or polygon. The "
                "file holds a point cloud, was cut short, or is of another format than its name "
                "says."
            )
        small = np.flatnonzero(sizes < 3)
        if len(small):
            raise damaged(
                f"face {small[0]} (counted from 0) has {sizes[small[0]]} corners; at least 3 are "
                "needed"
            )
        bad = np.flatnonzero((corners < 0) | (corners >= len(V)))
        if len(bad):
            face = np.searchsorted(np.cumsum(sizes), bad[0], side="right")
            raise damaged(
                f"face {face} (counted from 0) has a vertex index out of range, "
                f"{corners[bad[0]] + counted_from}; allowed is {counted_from} to "
                f"{len(V) - 1 + counted_from}"
            )
        return cls(V, corners, sizes, notices=notices)

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

    @property
    def polygons(self) -> list[NDArray[np.int64]]:
        """Yield the polygons in order, as blocks (k, c) of k consecutive ones with c corners."""
        ends = np.cumsum(self.sizes)
        last = np.flatnonzero(np.diff(self.sizes, append=0))
        blocks = np.split(self.corners, ends[last[:-1]])
        return [
            block.reshape(-1, c) for block, c in zip(blocks, self.sizes[last].tolist(), strict=True)
        ]

    @property
    def triangles(self) -> NDArray[np.int64]:
        """Return the polygons cut into triangles, (m, 3), in order."""
        if (self.sizes == 3).all():
            return self.corners.reshape(-1, 3)
        counts = self.sizes - 2
        first = np.repeat(np.cumsum(self.sizes) - self.sizes, counts)
        step = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def words_of(line: str) -> list[str]:
    """Split a line at ASCII spaces; `str.split` would also split at Unicode separators."""
    return line.translate(_NOT_SPACES).split()


def shown(text: str, most: int = 60) -> str:
    """Return a line of a file for a message: quoted, on one line and not too long."""
    text = text.strip()
    return repr(text if len(text) <= most else text[:most] + "...")


def refuse_underscores(words: list[str]) -> None:
    """Raise :class:`ValueError` for numbers that only Python accepts, such as 1_000."""
    if "_" in "".join(words):
        raise ValueError("an underscore is not part of a number")


def damaged(what: str) -> MeshError:
    """Return an error that says what is wrong in a file, and what to do about it."""
    return MeshError(
        f"{what}. The file is damaged, cut short, or of another format than its name says; export "
        "or download it again."
    )
