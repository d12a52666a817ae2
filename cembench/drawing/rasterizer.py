"""A z-buffer in numpy: the visible triangle at each pixel, for triangles of any size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np

from cembench.core.arrays import Indices, Real

#: Candidates (pixels in a triangle's bounding box) that are tested together. This bounds the
#: memory, and small portions stay in the cache.
CHUNK = 100_000
#: A pixel this close outside a triangle still counts, so that edges show no cracks.
TOLERANCE = 1e-9
#: Barycentric coordinates of a triangle's first corner.
START = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Raster:
    """The visible triangles of `size` times `size` pixels, with row 0 at the top.

    Parameters
    ----------
    size : int
        Pixels along a side.
    pixel : int64 (k,)
        The pixels that show a triangle: row times size plus column.
    face : int64 (k,)
        The triangle at each of them.
    weights : float64 (k, 3)
        Barycentric coordinates in that triangle.
    """

    size: int
    pixel: Indices
    face: Indices
    weights: Real

    def interpolate(self, corners: Real) -> Real:
        """Interpolate corner values, (3 m,) or (3 m, d) in order, at the pixels: (k, ...)."""
        at_corners = corners.reshape(-1, 3, *corners.shape[1:])
        along = (slice(None), *([None] * (corners.ndim - 1)))
        parts = (self.weights[:, c][along] * at_corners[self.face, c] for c in range(3))
        return cast(Real, sum(parts))

    def portions(self, most: int) -> Iterator[Raster]:
        """Yield the raster in portions of at most `most` pixels."""
        for start in range(0, len(self.pixel), most):
            held = slice(start, start + most)
            yield Raster(self.size, self.pixel[held], self.face[held], self.weights[held])


def rasterize(corners: Real, size: int) -> Raster:
    """Find the triangle nearest to the viewer at the centre of every pixel.

    Parameters
    ----------
    corners : float64 (3 m, 3)
        The triangles' corners in order, in window coordinates: x right, y up, -1 to 1; z towards
        the viewer. Both sides are visible; a triangle without area is not.
    size : int
        Pixels along a side.
    """
    place = np.stack([(corners[:, 0] + 1) / 2, (1 - corners[:, 1]) / 2], axis=1) * size - 0.5
    triangles = _Triangles.of(place.reshape(-1, 3, 2), corners[:, 2].reshape(-1, 3), size)
    depth = np.full(size * size, -np.inf)
    face = np.full(size * size, -1, dtype=np.int64)
    for faces in _portions(triangles.boxes):
        owner, pixel, height = triangles.covered(faces)
        np.maximum.at(depth, pixel, height)
        nearest = height == depth[pixel]
        face[pixel[nearest]] = owner[nearest]
    pixel = np.flatnonzero(face >= 0)
    seen = face[pixel]
    weights = np.empty((len(pixel), 3))
    for start in range(0, len(pixel), CHUNK):
        held = slice(start, start + CHUNK)
        weights[held] = triangles.weights(seen[held], pixel[held])
    return Raster(size, pixel, seen, weights)


@dataclass(frozen=True)
class _Triangles:
    """Triangles in pixel coordinates: x is the column, y the row, relative to the first corner.

    Barycentric coordinate k of a pixel is START[k] + x * across[k] + y * down[k].
    """

    size: int
    corner: Real  #: (2, m), the first corner's x and y
    across: Real  #: (3, m); NaN for a triangle without area
    down: Real  #: (3, m)
    depths: Real  #: (3, m), of the corners
    low: Indices  #: (2, m), lowest column and row of a pixel in the bounding box
    high: Indices  #: (2, m), highest

    @classmethod
    def of(cls, xy: Real, z: Real, size: int) -> _Triangles:
        a, u, v = xy[:, 0].T, (xy[:, 1] - xy[:, 0]).T, (xy[:, 2] - xy[:, 0]).T
        area = u[0] * v[1] - u[1] * v[0]
        area = np.where(area == 0, np.nan, area)
        across = np.stack([u[1] - v[1], v[1], -u[1]]) / area
        down = np.stack([v[0] - u[0], -v[0], u[0]]) / area
        low = np.clip(np.ceil(xy.min(axis=1) - TOLERANCE), 0, size).astype(np.int64)
        high = np.clip(np.floor(xy.max(axis=1) + TOLERANCE), -1, size - 1).astype(np.int64)
        high[np.isnan(area)] = -1
        return cls(size, a, across, down, z.T, low.T, high.T)

    @property
    def boxes(self) -> Indices:
        """Return the number of pixels in each bounding box, (m,)."""
        counts: Indices = np.maximum(self.high - self.low + 1, 0).prod(axis=0)
        return counts

    def covered(self, faces: Indices) -> tuple[Indices, Indices, Real]:
        """Return every pixel that these triangles cover: triangle, pixel and z."""
        tall = self.high[1, faces] - self.low[1, faces] + 1
        face = np.repeat(faces, tall)  # one row of pixels each
        row = _counted(tall) + np.repeat(self.low[1, faces], tall)
        x, y = self.corner[:, face]
        y = row - y
        left, right = (end[0, face].astype(np.float64) for end in (self.low, self.high))
        for start, across, down in zip(START, self.across, self.down, strict=True):
            slope, rest = across[face], start + TOLERANCE + y * down[face]
            with np.errstate(divide="ignore", invalid="ignore"):
                end = x - rest / slope
            left = np.where(slope > 0, np.maximum(left, np.ceil(end)), left)
            right = np.where(slope < 0, np.minimum(right, np.floor(end)), right)
            right = np.where((slope == 0) & (rest < 0), -1, right)
        wide = np.maximum(right - left + 1, 0).astype(np.int64)
        rise = self.depths[1:] - self.depths[0]
        by_column, by_row = ((rise * by[1:]).sum(axis=0)[face] for by in (self.across, self.down))
        first = self.depths[0, face] + y * by_row + (left - x) * by_column
        step = _counted(wide)
        pixel = np.repeat(row * self.size + left.astype(np.int64), wide) + step
        return (
            np.repeat(face, wide),
            pixel,
            np.repeat(first, wide) + step * np.repeat(by_column, wide),
        )

    def weights(self, face: Indices, pixel: Indices) -> Real:
        """Return the barycentric coordinates (k, 3) of pixels in triangles."""
        row = pixel // self.size
        x = pixel - row * self.size - self.corner[0][face]
        y = row - self.corner[1][face]
        weights = np.empty((len(face), 3))
        for k in (1, 2):
            weights[:, k] = x * self.across[k][face] + y * self.down[k][face]
        weights[:, 0] = 1 - weights[:, 1] - weights[:, 2]
        return weights


def _portions(candidates: Indices) -> list[Indices]:
    """Return the triangles with candidates, in portions of about CHUNK candidates each."""
    wanted = np.flatnonzero(candidates)
    portion = np.cumsum(candidates[wanted]) // CHUNK
    return np.split(wanted, np.flatnonzero(np.diff(portion)) + 1)


def _counted(counts: Indices) -> Indices:
    """Return 0, 1, ... up to each of these counts, concatenated."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
