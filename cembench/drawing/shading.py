"""Pictures of a surface and its image for reports: rasterized once, coloured in several ways.

A :class:`RasterPanel` knows the visible triangle at every sample of a picture. A checkerboard, the
mean curvature or the mesh edges can then be painted on the surface and the image without
rasterizing again. No graphics library is involved, so the same mesh gives the same bytes on every
machine.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cembench.conformal.planar import signed_areas
from cembench.drawing import scene as look
from cembench.drawing.camera import view_rotation
from cembench.drawing.checkerboard import FINER
from cembench.drawing.draw_numpy import LEGIBLE, SAMPLES, shrunk
from cembench.drawing.rasterizer import Raster, rasterize
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Picture = NDArray[np.uint8]

#: White space between panels side by side, in pixels.
GAP = 12
#: JPEG quality; a picture of two panels takes about 30 kB.
QUALITY = 70
#: Half the width of a drawn edge, in samples; colours of edges and of triangles.
EDGE, EDGE_COLOUR, BETWEEN = 0.5 * SAMPLES, (0.16, 0.25, 0.36), (0.93, 0.94, 0.95)
#: Curvature from inwards over flat to outwards: blue, white, orange; distinct in grey scale and for
#: colour-blind readers.
INWARDS, EVEN, OUTWARDS = (0.13, 0.33, 0.62), (0.96, 0.96, 0.94), (0.80, 0.35, 0.05)
#: The colour scale ends at this quantile of the absolute curvature.
EXTREME = 0.95


@dataclass(frozen=True)
class RasterPanel:
    """The rasterized view of a mesh that was placed before the viewer.

    Parameters
    ----------
    F : int64 (m, 3)
        Triangles.
    points : float64 (n, 3)
        Vertices in window coordinates.
    raster : Raster
        The visible triangle at each sample.
    light : float64 (k,)
        Brightness there, 0 to 1.
    folded : bool (m,)
        Triangles that the map folds over; they are drawn red.

    """

    F: NDArray[np.int64]
    points: Real
    raster: Raster
    light: Real
    folded: NDArray[np.bool_]

    def at(self, values: Real) -> Real:
        """Interpolate vertex values, (n,) or (n, d), at the visible samples: (k,) or (k, d)."""
        corners = values[self.F]
        return self.raster.interpolate(corners.reshape(-1, *values.shape[1:]))


def surface_panel(mesh: TriangleMesh, side: int) -> RasterPanel:
    """Rasterize the surface as the viewer sees it; `side` in pixels."""
    points = look.framed(mesh.V @ view_rotation(mesh).T)
    light = look.brightness_of(mesh.F, points)
    panel = _panel(mesh, points, light, np.zeros(mesh.m, dtype=bool), side)
    inside = look.doubled_areas(points[mesh.F].reshape(-1, 3)[:, :2]) < 0
    dimmed = np.where(inside[panel.raster.face], look.INSIDE, 1.0)
    return RasterPanel(panel.F, points, panel.raster, panel.light * dimmed, panel.folded)


def image_panel(mesh: TriangleMesh, uv: Complex, side: int) -> RasterPanel:
    """Rasterize the image with the surface's shading, weaker; `side` in pixels."""
    shade = look.brightness_of(mesh.F, look.framed(mesh.V @ view_rotation(mesh).T))
    folded = ~(signed_areas(uv, mesh.F) > 0)
    return _panel(mesh, look.image_in_window(uv), 1 - look.FAINTER * (1 - shade), folded, side)


def _panel(
    mesh: TriangleMesh, points: Real, light: Real, folded: NDArray[np.bool_], side: int
) -> RasterPanel:
    """Rasterize triangles at these points, folds on top."""
    corners = points[mesh.F].reshape(-1, 3)
    corners[np.repeat(folded, 3), 2] += 1.0  # folds on top
    raster = rasterize(corners, side * SAMPLES)
    return RasterPanel(mesh.F, points, raster, raster.interpolate(light[mesh.F].ravel()), folded)


def paint(panel: RasterPanel, colour: Real) -> Picture:
    """Return the picture uint8 (side, side, 3) on white; `colour` is (k, 3), 0 to 1."""
    seen = np.where(panel.folded[panel.raster.face, None], look.FOLDED, colour)
    canvas = np.ones((panel.raster.size**2, 3))
    canvas[panel.raster.pixel] = seen * panel.light[:, None]
    return shrunk(255 * canvas.reshape(panel.raster.size, panel.raster.size, 3))


def checkerboard(panel: RasterPanel, mesh: TriangleMesh, uv: Complex, surface: RasterPanel) -> Real:
    """Return the colours of a checkerboard on the image, pulled back if the panel is the surface.

    As in :mod:`cembench.drawing.scene`, squares are divided where they would be large on `surface`.
    """
    board = look.image_in_window(uv)[:, :2] * (look.SQUARES / 2 / look.FILL)
    squares = look.checkerboard_of(mesh.F, surface.points, board)
    dark, level = squares.at(panel.at(board))
    drawn = np.abs(look.doubled_areas(_samples(panel).reshape(-1, 2)))
    flat = np.abs(look.doubled_areas(board[mesh.F].reshape(-1, 2)))
    pixels = np.sqrt(drawn / np.maximum(flat, look.TINY))[panel.raster.face] / (
        FINER**level * SAMPLES
    )
    share = 0.5 + (dark - 0.5) * np.clip((pixels - 1) / (LEGIBLE - 1), 0, 1)
    return _between(look.LIGHT, look.DARK, np.asarray(share, dtype=np.float64))


def curvature(panel: RasterPanel, H: Real) -> Real:
    """Return the colours of the mean curvature H (n,): blue inwards, orange outwards."""
    extreme = float(np.quantile(np.abs(H), EXTREME)) or 1.0
    share = np.clip(panel.at(H) / extreme, -1, 1)
    towards = np.where(share[:, None] < 0, INWARDS, OUTWARDS)
    return np.array(EVEN) + np.abs(share)[:, None] * (towards - np.array(EVEN))


def edges(panel: RasterPanel) -> Real:
    """Return the colours of the mesh: dark edges, grey where triangles are too small to see."""
    corners = _samples(panel)
    doubled = np.abs(look.doubled_areas(corners.reshape(-1, 2)))
    opposite = side_lengths(corners.reshape(-1, 2), np.arange(3 * len(corners)).reshape(-1, 3))
    heights = doubled[:, None] / np.maximum(opposite, look.TINY)
    distance = (panel.raster.weights * heights[panel.raster.face]).min(axis=1)
    return _between(BETWEEN, EDGE_COLOUR, np.clip(EDGE + 0.5 - distance, 0, 1) * 0.85)


def _samples(panel: RasterPanel) -> Real:
    """Return the triangles' corners (m, 3, 2) in samples of the picture."""
    return panel.points[panel.F][:, :, :2] * (panel.raster.size / 2)


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
