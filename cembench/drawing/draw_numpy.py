"""Draw a scene without a graphics library: slower than a graphics card, but always available."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cembench.drawing import scene as look
from cembench.drawing.checkerboard import FINER, MOST_LEVELS
from cembench.drawing.rasterizer import Raster, rasterize
from cembench.drawing.scene import Scene, View, doubled_areas

Real = NDArray[np.float64]
Picture = NDArray[np.uint8]

#: Samples along each side of a pixel.
SAMPLES = 2
#: Squares narrower than this many pixels fade to their mean colour, grey-blue.
LEGIBLE = 2.5
#: Samples that are coloured together: few enough to stay in the cache.
PORTION = 1 << 16


def draw(scene: Scene, side: int) -> tuple[Picture, Picture]:
    """Draw the surface and its image; two pictures uint8 (side, side, 3) on white."""
    return _drawn(scene, scene.surface, side), _drawn(scene, scene.image, side)


def averaged(samples: NDArray[Any]) -> NDArray[Any]:
    """Average the samples of each pixel: (SAMPLES s, SAMPLES s, ...) to (s, s, ...)."""
    rows = np.add.reduce([samples[k::SAMPLES] for k in range(SAMPLES)])  # they are contiguous
    return np.asarray(np.add.reduce([rows[:, k::SAMPLES] for k in range(SAMPLES)]) / SAMPLES**2)


def shrunk(picture: Real) -> Picture:
    """Average the samples of each pixel; values 0 to 255."""
    return np.round(averaged(picture)).astype(np.uint8)


def _drawn(scene: Scene, view: View, side: int) -> Picture:
    """Draw one panel of a scene."""
    raster = rasterize(view.corners, side * SAMPLES)
    # Averaged over a pixel's samples: its shares of empty, light, dark and folded.
    parts = np.zeros((4, raster.size**2), dtype=np.float32)
    parts[0] = 1
    sides = _square_sides(scene, view, side)
    corners = np.column_stack([scene.board, view.brightness])
    seen = [_fill(parts, scene, corners, portion, sides) for portion in raster.portions(PORTION)]
    _outline(parts, np.concatenate([np.empty(0, np.int64), *seen]), raster.size)
    shares = [averaged(part.reshape(raster.size, raster.size)) for part in parts]
    colours = np.array([(1, 1, 1), look.LIGHT, look.DARK, look.FOLDED], dtype=np.float32)
    return np.round(255 * np.stack(shares, axis=2) @ colours).astype(np.uint8)


def _fill(
    parts: NDArray[np.float32], scene: Scene, corners: Real, raster: Raster, sides: Real
) -> NDArray[np.int64]:
    """Distribute the light of samples among the parts, in place; return the folded samples."""
    found = raster.interpolate(corners)
    light, folded = found[:, 2], scene.folded[raster.face]
    dark = _darkness(scene, found[:, :2], sides[raster.face]) * light
    parts[0, raster.pixel] = 0
    parts[1, raster.pixel] = light - dark
    parts[2, raster.pixel] = dark
    red = raster.pixel[folded]
    parts[1:3, red] = 0
    parts[3, red] = light[folded]
    return red


def _square_sides(scene: Scene, view: View, side: int) -> Real:
    """Return the drawn width of a square of the board in each triangle, in pixels; shape (m,)."""
    board = np.abs(doubled_areas(scene.board))
    drawn = np.abs(doubled_areas(view.corners[:, :2])) * (side / 2) ** 2
    return np.sqrt(drawn / np.maximum(board, look.TINY))


def _darkness(scene: Scene, places: Real, sides: Real) -> Real:
    """Return the darkness of the board at points; half where its squares are too small to draw."""
    dark, level = scene.squares.at(places)
    smaller = float(FINER) ** -np.arange(MOST_LEVELS + 1)
    contrast = np.clip((sides * smaller[level] - 1) / (LEGIBLE - 1), 0, 1)
    return np.asarray(0.5 + (dark - 0.5) * contrast)


def _outline(parts: NDArray[np.float32], folded: NDArray[np.int64], size: int) -> None:
    """Outline folds in their colour, in place, since a fold may be smaller than a pixel."""
    if len(folded):
        seen = np.zeros(size * size, dtype=bool)
        seen[folded] = True
        rim = ndimage.binary_dilation(seen.reshape(size, size), iterations=SAMPLES)
        parts[:, rim.ravel() & ~seen] = np.array([0, 0, 0, 1], dtype=np.float32)[:, None]
