"""Clay rendering: one colour, one light, no camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.drawing.draw_numpy import SAMPLES, Picture, averaged
from cembench.drawing.rasterizer import rasterize
from cembench.drawing.scene import INSIDE, brightness_of, doubled_areas

#: RGB colour of a fully lit surface, 0 to 1.
CLAY = (0.90, 0.80, 0.71)


def draw_clay(F: NDArray[np.int64], points: NDArray[np.float64], side: int) -> Picture:
    """Draw a surface whose vertices are in window coordinates (n, 3); uint8 (side, side, 3)."""
    corners = points[F].reshape(-1, 3)
    raster = rasterize(corners, side * SAMPLES)
    light = raster.interpolate(brightness_of(F, points)[F].ravel())
    light = np.where(doubled_areas(corners[:, :2])[raster.face] < 0, INSIDE * light, light)
    shade, white = np.zeros(raster.size**2), np.ones(raster.size**2)
    shade[raster.pixel], white[raster.pixel] = light, 0.0
    shade, white = (averaged(one.reshape(raster.size, raster.size)) for one in (shade, white))
    return np.round(255 * (white[:, :, None] + shade[:, :, None] * np.array(CLAY))).astype(np.uint8)
