"""Polygons as a file holds them, before any check of the surface.

A :class:`Soup` may have isolated vertices, NaN coordinates, and edges of any number of polygons.
:func:`~cembench.mesh.files.read_mesh` checks it; repairs start from it. Files that say one
thing and hold another never become one: their readers raise :func:`damaged`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.errors import MeshError
from cembench.core.notices import Notice

#: What `str.split` takes for space though no mesh format does.
_NOT_SPACES = dict.fromkeys(map(ord, "\x1c\x1d\x1e\x1f\x85\xa0"), "\0")

#: How UTF-8 text may begin, read as Latin-1.
BYTE_ORDER_MARK = b"\xef\xbb\xbf".decode("latin-1")


@dataclass(frozen=True, eq=False)
class Soup:
    """Vertices and polygons; only the indices are checked.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices, all of them, in the file's order.
    corners : int64 (sum of sizes,)
        Vertex indices, 0 to n - 1, of all polygons, one after another in the file's order.
    sizes : int64 (k,)
        Number of corners of each polygon, at least 3.
    name : str
        What reports call it: the file's stem.
    notices : tuple of Notice
        What was changed or ignored while the file was read.

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
        """Check that there are polygons, and that their corners are vertices that exist.

        The file counts vertices from `counted_from`, and so do the messages.

        Raises
        ------
        MeshError
            There is no polygon, one with fewer than three corners, or an index out of range.

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
        """The same under another name."""
        return replace(self, name=name)

    def subset(self, first: int, last: int) -> Self:
        """Return the polygons from `first` to `last`, counted from 0, and their vertices only.

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
        """The polygons in order, as blocks (k, c) of k successive ones with c corners each."""
        ends = np.cumsum(self.sizes)
        last = np.flatnonzero(np.diff(self.sizes, append=0))
        blocks = np.split(self.corners, ends[last[:-1]])
        return [
            block.reshape(-1, c) for block, c in zip(blocks, self.sizes[last].tolist(), strict=True)
        ]

    @property
    def triangles(self) -> NDArray[np.int64]:
        """The polygons cut into triangles by fans from their first corners, (m, 3), in order."""
        if (self.sizes == 3).all():
            return self.corners.reshape(-1, 3)
        counts = self.sizes - 2
        first = np.repeat(np.cumsum(self.sizes) - self.sizes, counts)
        step = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def words_of(line: str) -> list[str]:
    """Split a line at ASCII spaces; `str.split` also splits at separators of other alphabets."""
    return line.translate(_NOT_SPACES).split()


def shown(text: str, most: int = 60) -> str:
    """A line of a file for a message: quoted, on one line and not too long."""
    text = text.strip()
    return repr(text if len(text) <= most else text[:most] + "...")


def refuse_underscores(words: list[str]) -> None:
    """Raise :class:`ValueError` for what only Python reads as a number, such as 1_000."""
    if "_" in "".join(words):
        raise ValueError("an underscore is not part of a number")


def damaged(what: str) -> MeshError:
    """An error that says what is wrong in a file, and what to do about it."""
    return MeshError(
        f"{what}. The file is damaged, cut short, or of another format than its name says; export "
        "or download it again."
    )
