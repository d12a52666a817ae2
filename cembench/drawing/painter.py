"""Paint pictures of a surface and its image: rasterized once, coloured in several ways.

A :class:`Panel` knows the visible triangle at every sample of a picture. A checkerboard, the mean
curvature, the mesh edges or plain clay can then be painted on it without rasterizing again. No
graphics library is involved, so the same mesh gives the same bytes on every machine.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from cembench.core.arrays import Complex, Indices, Mask, Picture, Real
from cembench.drawing import scene as look
from cembench.drawing.checkerboard import FINER, MAX_LEVELS
from cembench.drawing.rasterizer import Raster, rasterize
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import TriangleMesh

#: Returns the RGB colours (k, 3) or (3,) of a portion of a panel's samples, 0 to 1.
Colouring = Callable[[Raster], Any]

#: Samples along each side of a pixel.
SAMPLES = 2
#: Samples that are coloured together: few enough to stay in the cache.
PORTION = 1 << 16
#: Squares narrower than this many pixels fade to their mean colour, grey-blue.
LEGIBLE = 2.5
#: White space between panels side by side, in pixels.
GAP = 12
#: JPEG quality; a picture of two panels takes about 30 kB.
QUALITY = 70
#: RGB colour of a fully lit surface without a pattern, 0 to 1.
CLAY = (0.90, 0.80, 0.71)
#: Half the width of a drawn edge, in samples; colours of edges and of triangles.
EDGE, EDGE_COLOUR, BETWEEN = 0.5 * SAMPLES, (0.16, 0.25, 0.36), (0.93, 0.94, 0.95)
#: Curvature from inwards over flat to outwards: blue, white, orange; distinct in grey scale and for
#: colour-blind readers.
INWARDS, EVEN, OUTWARDS = (0.13, 0.33, 0.62), (0.96, 0.96, 0.94), (0.80, 0.35, 0.05)
#: The darkest colour of angle errors, and the error in degrees from which on it is used.
WORST, ANGLE_SCALE = (0.55, 0.0, 0.15), 30.0
#: The colour scale ends at this quantile of the absolute curvature.
EXTREME = 0.95


@dataclass(frozen=True)
class Panel:
    """The rasterized view of triangles in window coordinates.

    Parameters
    ----------
    F : int64 (m, 3)
        Triangles.
    points : float64 (n, 3)
        Vertices in window coordinates.
    raster : Raster
        The visible triangle at each sample.
    light : float64 (m, 3)
        Brightness of each triangle's corners, 0 to 1.
    """

    F: Indices
    points: Real
    raster: Raster
    light: Real

    @property
    def corners(self) -> Real:
        """The triangles' corners (m, 3, 2) in samples of the picture."""
        return self.points[self.F][:, :, :2] * (self.raster.size / 2)


def under_checkerboard(
    mesh: TriangleMesh, uv: Complex, side: int
) -> tuple[Picture, Picture, look.Board]:
    """Draw a surface and its image (n,) under one checkerboard, folds red; `side` in pixels.

    Returns the two pictures uint8 (side, side, 3), and the checkerboard.
    """
    space, folded = look.surface_in_window(mesh), look.folded_by(uv, mesh.F)
    board = look.Board.of(mesh.F, space, uv)
    surface = surface_panel(mesh.F, space, side)
    image = image_panel(mesh.F, space, uv, folded, side)
    first, second = (paint(p, checkerboard(p, board), folded) for p in (surface, image))
    return first, second, board


def surface_panel(F: Indices, points: Real, side: int) -> Panel:
    """Rasterize a surface with vertices (n, 3) in the window; its inside is darker."""
    corners = points[F]
    light = look.brightness_of(F, points)[F]
    light[look.doubled_areas(corners) < 0] *= look.INSIDE
    return Panel(F, points, rasterize(corners.reshape(-1, 3), side * SAMPLES), light)


def image_panel(F: Indices, space: Real, uv: Complex, folded: Mask, side: int) -> Panel:
    """Rasterize an image (n,), folds on top, with the surface's shading, weaker."""
    points = look.image_in_window(uv)
    corners = points[F]
    corners[folded, :, 2] += 1.0
    light = 1 - look.FAINTER * (1 - look.brightness_of(F, space)[F])
    return Panel(F, points, rasterize(corners.reshape(-1, 3), side * SAMPLES), light)


def paint(panel: Panel, colouring: Colouring, folded: Mask | None = None) -> Picture:
    """Return a picture uint8 (side, side, 3) on white.

    Triangles that are `folded` (m,) are red, and outlined: a fold may be smaller than a pixel.
    """
    size = panel.raster.size
    canvas = np.ones((size * size, 3), dtype=np.float32)
    light = panel.light.ravel()
    for portion in panel.raster.portions(PORTION):
        colour = colouring(portion)
        if folded is not None:
            colour = np.where(folded[portion.face, None], look.FOLDED, colour)
        canvas[portion.pixel] = colour * portion.interpolate(light)[:, None]
    if folded is not None:
        seen = np.zeros(size * size, dtype=bool)
        seen[panel.raster.pixel[folded[panel.raster.face]]] = True
        if seen.any():
            rim = ndimage.binary_dilation(seen.reshape(size, size), iterations=SAMPLES)
            canvas[rim.ravel() & ~seen] = look.FOLDED
    return shrunk(255 * canvas.reshape(size, size, 3))


def shrunk(samples: NDArray[Any]) -> Picture:
    """Average the samples of each pixel, (SAMPLES s, SAMPLES s, 3) to (s, s, 3)."""
    rows = np.add.reduce([samples[k::SAMPLES] for k in range(SAMPLES)])  # they are contiguous
    total = np.add.reduce([rows[:, k::SAMPLES] for k in range(SAMPLES)])
    return np.round(total / SAMPLES**2).astype(np.uint8)


def draw_clay(F: Indices, points: Real, side: int) -> Picture:
    """Draw a surface, vertices (n, 3) in the window, in one colour; uint8 (side, side, 3)."""
    return paint(surface_panel(F, points, side), lambda _: CLAY)


def checkerboard(panel: Panel, board: look.Board) -> Colouring:
    """Colour a panel by a checkerboard; squares too small to draw fade to their mean."""
    F = panel.F
    places = board.places[F].reshape(-1, 2)
    drawn, flat = (np.abs(look.doubled_areas(c)) for c in (panel.corners, board.places[F]))
    pixels = np.sqrt(drawn / np.maximum(flat, look.TINY)) / SAMPLES
    smaller = float(FINER) ** -np.arange(MAX_LEVELS + 1)

    def colouring(raster: Raster) -> Real:
        dark, level = board.squares.at(raster.interpolate(places))
        contrast = np.clip((pixels[raster.face] * smaller[level] - 1) / (LEGIBLE - 1), 0, 1)
        return _between(look.LIGHT, look.DARK, 0.5 + (dark - 0.5) * contrast)

    return colouring


def curvature(panel: Panel, H: Real) -> Colouring:
    """Colour a panel by the mean curvature H (n,): blue inwards, orange outwards."""
    corners = (H / (float(np.quantile(np.abs(H), EXTREME)) or 1.0))[panel.F].ravel()

    def colouring(raster: Raster) -> Real:
        share = np.clip(raster.interpolate(corners), -1, 1)
        towards = np.where(share[:, None] < 0, INWARDS, OUTWARDS)
        return np.array(EVEN) + np.abs(share)[:, None] * (towards - np.array(EVEN))

    return colouring


def angle_colours(errors: Real) -> Colouring:
    """Colour triangles by their angle errors (m,) in degrees, from white to dark red."""
    shares = np.sqrt(np.clip(errors / ANGLE_SCALE, 0, 1))
    return lambda raster: _between(EVEN, WORST, shares[raster.face])


def edges(panel: Panel) -> Colouring:
    """Colour a panel's edges dark; grey where triangles are too small to be seen."""
    corners = panel.corners
    doubled = np.abs(look.doubled_areas(corners))
    opposite = side_lengths(corners.reshape(-1, 2), np.arange(3 * len(corners)).reshape(-1, 3))
    heights = doubled[:, None] / np.maximum(opposite, look.TINY)

    def colouring(raster: Raster) -> Real:
        distance = (raster.weights * heights[raster.face]).min(axis=1)
        return _between(BETWEEN, EDGE_COLOUR, np.clip(EDGE + 0.5 - distance, 0, 1) * 0.85)

    return colouring


def _between(first: Sequence[float], second: Sequence[float], share: Real) -> Real:
    return np.array(first) + share[:, None] * (np.array(second) - np.array(first))


def beside(pictures: Sequence[Picture]) -> Picture:
    """Place pictures of equal height side by side."""
    white = np.full((len(pictures[0]), GAP, 3), 255, dtype=np.uint8)
    parts = [part for picture in pictures for part in (white, picture)]
    return np.hstack(parts[1:])


def jpeg(picture: Picture) -> bytes:
    """Return a JPEG file; the same picture gives the same bytes."""
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "JPEG", quality=QUALITY, optimize=True)
    return buffer.getvalue()
