"""A surface with texture coordinates, for the writers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError

Points = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Textured:
    """Triangles and their texture coordinates.

    Parameters
    ----------
    V, F : float64 (n, 3), int64 (m, 3)
        The surface.
    uv : float64 (k, 2), optional
        Texture coordinates; v points up.
    corners : int64 (m, 3), optional
        The texture coordinate of each corner (default: that of its vertex).
    texture : bytes, optional
        The texture image, as a PNG file.
    texture_file : str, optional
        Name of that file, for formats that refer to a file beside them.
    name : str
        Name of the surface.

    """

    V: Points
    F: Indices
    uv: Points | None = None
    corners: Indices | None = None
    texture: bytes | None = None
    texture_file: str | None = None
    name: str = "mesh"

    @property
    def has_seams(self) -> bool:
        """Whether the corners at some vertex have different texture coordinates."""
        return self.corners is not None and not np.array_equal(self.corners, self.F)

    def cut_at_seams(self) -> Textured:
        """Return the same surface with one vertex for each texture coordinate of a vertex.

        The original vertex keeps the texture coordinate of its first triangle; copies come last.
        """
        if self.uv is None or self.corners is None:
            return self
        pairs = np.stack([self.F, self.corners], axis=2).reshape(-1, 2)
        found, inverse = np.unique(pairs, axis=0, return_inverse=True)
        order = np.lexsort((found[:, 0], found[:, 1]))
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        vertex, texture = found[order].T
        F = place[inverse.ravel()].reshape(-1, 3)
        return replace(self, V=self.V[vertex], F=F, uv=self.uv[texture], corners=None)

    def normals(self) -> Points:
        """Return unit normals at the vertices, averaged by triangle area, (n, 3)."""
        a, b, c = (self.V[self.F[:, k]] for k in range(3))
        size = float(np.abs(self.V).max()) or 1.0  # to avoid overflow of squares
        faces = np.cross((b - a) / size, (c - a) / size)
        total = np.zeros_like(self.V)
        for k in range(3):
            for axis in range(3):
                total[:, axis] += np.bincount(self.F[:, k], faces[:, axis], len(self.V))
        length = np.linalg.norm(total, axis=1, keepdims=True)
        up = np.array([0.0, 0.0, 1.0])
        return np.where(length > 0, total / np.where(length > 0, length, 1.0), up)


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
