"""Which triangle is seen at each pixel? A z-buffer in numpy, for triangles of any size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Candidates (pixels in a triangle's bounding box) that are looked at together; bounds the memory.
CHUNK = 2_000_000
#: A pixel this little outside a triangle still counts, so that no cracks show along edges.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Raster:
    """What is seen: for each of the `size` times `size` pixels, row 0 on top.

    Parameters
    ----------
    size : int
        Pixels along a side.
    pixel : int64 (k,)
        Those where something is seen: row times size plus column.
    face : int64 (k,)
        The triangle there.
    weights : float64 (k, 3)
        Where in the triangle: barycentric coordinates.

    """

    size: int
    pixel: Ints
    face: Ints
    weights: Real

    def interpolate(self, corners: Real) -> Real:
        """Values at the triangles' corners in turn, (3 m,) or (3 m, d), at the pixels: (k, ...)."""
        at_corners = corners.reshape(-1, 3, *corners.shape[1:])[self.face]
        return np.einsum("kc,kc...->k...", self.weights, at_corners)


def rasterize(corners: Real, size: int) -> Raster:
    """Find the triangle nearest to the viewer at the centre of every pixel.

    Parameters
    ----------
    corners : float64 (3 m, 3)
        The triangles' corners in turn, in window coordinates: x right, y up, -1 to 1; z towards
        the viewer. Either side up; a triangle without area is not seen.
    size : int
        Pixels along a side.

    """
    place = np.stack([(corners[:, 0] + 1) / 2, (1 - corners[:, 1]) / 2], axis=1) * size - 0.5
    xy, z = place.reshape(-1, 3, 2), corners[:, 2].reshape(-1, 3)
    depth = np.full(size * size, -np.inf)
    face = np.full(size * size, -1, dtype=np.int64)
    low, counts = _boxes(xy, size)
    for faces in _portions(counts.prod(axis=1)):
        owner, pixel = _candidates(faces, low, counts, size)
        weights = _weights(xy[owner], pixel, size)
        covered = (weights >= -TOLERANCE).all(axis=1)
        owner, pixel = owner[covered], pixel[covered]
        _enter(owner, pixel, (weights[covered] * z[owner]).sum(axis=1), depth, face)
    pixel = np.flatnonzero(face >= 0)
    return Raster(size, pixel, face[pixel], _weights(xy[face[pixel]], pixel, size))


def _boxes(xy: Real, size: int) -> tuple[Ints, Ints]:
    """Lowest column and row (m, 2) of the pixel centres in each bounding box, and how many."""
    low = np.clip(np.ceil(xy.min(axis=1) - TOLERANCE), 0, size).astype(np.int64)
    high = np.clip(np.floor(xy.max(axis=1) + TOLERANCE), -1, size - 1).astype(np.int64)
    return low, np.maximum(high - low + 1, 0)


def _portions(candidates: Ints) -> list[Ints]:
    """The triangles that have candidates, in portions of about CHUNK candidates each."""
    wanted = np.flatnonzero(candidates)
    portion = np.cumsum(candidates[wanted]) // CHUNK
    return np.split(wanted, np.flatnonzero(np.diff(portion)) + 1)


def _candidates(faces: Ints, low: Ints, counts: Ints, size: int) -> tuple[Ints, Ints]:
    """Every pixel of these triangles' bounding boxes: whose it is, and which pixel."""
    wide = counts[faces, 0]
    each = wide * counts[faces, 1]
    owner = np.repeat(faces, each)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
    row, column = np.divmod(place, np.repeat(wide, each))
    return owner, (low[owner, 1] + row) * size + low[owner, 0] + column


def _weights(xy: Real, pixel: Ints, size: int) -> Real:
    """Barycentric coordinates (k, 3) of pixels in triangles (k, 3, 2); NaN without area."""
    row, column = np.divmod(pixel, size)
    a, u, v = xy[:, 0], xy[:, 1] - xy[:, 0], xy[:, 2] - xy[:, 0]
    x, y = column - a[:, 0], row - a[:, 1]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area[area == 0] = np.nan
    second = (x * v[:, 1] - y * v[:, 0]) / area
    third = (u[:, 0] * y - u[:, 1] * x) / area
    return np.stack([1 - second - third, second, third], axis=1)


def _enter(owner: Ints, pixel: Ints, height: Real, depth: Real, face: Ints) -> None:
    """Put what is nearer than before into the buffers `depth` and `face`."""
    order = np.argsort(height, kind="stable")
    order = order[height[order] > depth[pixel[order]]]
    depth[pixel[order]] = height[order]  # a pixel that comes up twice keeps the last, the nearest
    face[pixel[order]] = owner[order]
