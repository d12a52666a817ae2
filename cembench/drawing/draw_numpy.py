"""Draws a scene without any graphics library: slower than a graphics card, but always there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cembench.drawing import scene as look
from cembench.drawing.rasterizer import Raster, rasterize
from cembench.drawing.scene import Scene, View, doubled_areas

Real = NDArray[np.float64]
Picture = NDArray[np.uint8]

#: Samples along each side of a pixel.
SAMPLES = 2
#: Squares of the board narrower than this many pixels begin to melt into grey-blue.
LEGIBLE = 2.5


def draw(scene: Scene, side: int) -> tuple[Picture, Picture]:
    """How do the surface and its image look? Two pictures uint8 (side, side, 3), on white."""
    return _drawn(scene, scene.surface, side), _drawn(scene, scene.image, side)


def averaged(samples: Real) -> Real:
    """Average the samples of each pixel: (SAMPLES s, SAMPLES s, ...) to (s, s, ...)."""
    steps = range(SAMPLES)
    total: Real = sum(samples[i::SAMPLES, j::SAMPLES] for i in steps for j in steps)  # type: ignore[assignment]
    return total / SAMPLES**2


def shrunk(picture: Real) -> Picture:
    """Average the samples of each pixel; values 0 to 255."""
    return np.round(averaged(picture)).astype(np.uint8)


def _drawn(scene: Scene, view: View, side: int) -> Picture:
    raster = rasterize(view.corners, side * SAMPLES)
    colour = _board_colour(scene, raster, _square_sides(scene, view, side))
    folded = scene.folded[raster.face]
    colour[folded] = look.FOLDED
    canvas = np.ones((raster.size**2, 3))
    canvas[raster.pixel] = colour * raster.interpolate(view.brightness)[:, None]
    _outline(canvas, raster.pixel[folded], raster.size)
    return shrunk(255 * canvas.reshape(raster.size, raster.size, 3))


def _square_sides(scene: Scene, view: View, side: int) -> Real:
    """How many pixels wide is a square of the board, as drawn, in each triangle? Shape (m,)."""
    board = np.abs(doubled_areas(scene.board))
    drawn = np.abs(doubled_areas(view.corners[:, :2])) * (side / 2) ** 2
    return np.sqrt(drawn / np.maximum(board, look.TINY))


def _board_colour(scene: Scene, raster: Raster, sides: Real) -> Real:
    """The checkerboard at each pixel; a mean colour where its squares cannot be told apart."""
    place = np.floor(raster.interpolate(scene.board)).astype(np.int64)
    dark = (place.sum(axis=1) % 2).astype(np.float64)
    contrast = np.clip((sides[raster.face] - 1) / (LEGIBLE - 1), 0, 1)
    share = 0.5 + (dark - 0.5) * contrast
    return np.array(look.LIGHT) + share[:, None] * (np.array(look.DARK) - np.array(look.LIGHT))


def _outline(canvas: Real, folded: NDArray[np.int64], size: int) -> None:
    """A fold may be smaller than a pixel: give it a rim of its colour, in place."""
    if len(folded):
        seen = np.zeros(size * size, dtype=bool)
        seen[folded] = True
        rim = ndimage.binary_dilation(seen.reshape(size, size), iterations=SAMPLES)
        canvas[rim.ravel() & ~seen] = look.FOLDED
