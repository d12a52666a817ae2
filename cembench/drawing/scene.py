"""How a surface, its image and a checkerboard lie in a picture, and how they are lit.

Window coordinates: x to the right and y upwards, both from -1 to 1 in a square panel; z towards the
viewer. A **square** of the checkerboard has side 1 in the coordinates `board`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.planar import signed_areas
from cembench.core.arrays import Complex, Indices, Real
from cembench.drawing.camera import view_rotation
from cembench.drawing.checkerboard import FINER, MAX_LEVELS, Checkerboard
from cembench.mesh.triangle_mesh import TriangleMesh

#: Squares of the coarsest checkerboard across the image.
SQUARES = 18
#: Squares are divided where their side on the drawn surface would exceed this.
LARGEST_SQUARE = 0.22
#: Rounds of averaging the sizes of squares over neighbours, for smooth borders of refinement.
CALMING = 3
#: Side of the smallest detail in the image that a person notices.
MIN_VISIBLE = 0.02
#: Replaces an area of zero.
TINY = 1e-300
#: Share of a panel's half width that the drawing takes.
FILL = 0.97
#: RGB colours, 0 to 1: the board's two, and that of a folded triangle.
LIGHT, DARK, FOLDED = (0.95, 0.935, 0.90), (0.33, 0.52, 0.72), (0.86, 0.11, 0.13)
#: Direction to the lamp in window coordinates; brightness of a face turned away from the lamp, what
#: is added when it faces the lamp, the falloff between, and the factor for the surface's inside.
LAMP = np.array([-0.45, 0.55, 0.70]) / np.sqrt(0.995)
SHADOW, LAMPLIGHT, FALL_OFF, INSIDE = 0.30, 0.78, 1.6, 0.62
#: The image shows the same shading, but weaker: half of the surface faces away there.
FAINTER = 0.55


@dataclass(frozen=True)
class Board:
    """A checkerboard on an image, to be pulled back to the surface.

    Parameters
    ----------
    places : float64 (n, 2)
        Position of each vertex on the board.
    squares : Checkerboard
        Which squares are divided.
    """

    places: Real
    squares: Checkerboard

    @classmethod
    def of(cls, F: Indices, space: Real, uv: Complex) -> Self:
        """Return the board of an image (n,); squares large on the surface `space` are divided.

        `space` is (n, 3) in window coordinates.
        """
        places = image_in_window(uv)[:, :2] * (SQUARES / 2 / FILL)
        area = np.linalg.norm(_normals(F, space), axis=1)
        fineness = fineness_of(F, space, places)[F].mean(axis=1)
        return cls(places, Checkerboard.of(places[F].mean(axis=1), fineness, area))


def surface_in_window(mesh: TriangleMesh) -> Real:
    """Return the vertices of a surface turned towards the viewer; window coordinates (n, 3)."""
    return framed(mesh.V @ view_rotation(mesh).T)


def folded_by(uv: Complex, F: Indices) -> NDArray[np.bool_]:
    """Whether each triangle's image has no positive area, (m,)."""
    return np.asarray(~(signed_areas(uv, F) > 0))


def small_folds(uv: Complex, F: Indices) -> Real:
    """Return the centres (k, 2) of those folds F (j, 3) that are too small to be seen."""
    corners = image_in_window(uv)[F][:, :, :2]
    return corners[np.abs(doubled_areas(corners)) < MIN_VISIBLE**2].mean(axis=1)


def image_in_window(uv: Complex) -> Real:
    """Return the images of the vertices in the panel; window coordinates (n, 3), z = 0."""
    return framed(np.stack([uv.real, uv.imag, np.zeros(len(uv))], axis=1))


def doubled_areas(corners: Real) -> Real:
    """Return twice the signed area of triangles in the window, corners (m, 3, 2 or 3)."""
    u, v = (corners[:, c, :2] - corners[:, 0, :2] for c in (1, 2))
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def framed(points: Real) -> Real:
    """Shift and scale points so that x and y fill the panel; depth is scaled alike."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low)[:2].max()) or 1.0
    return (points - (low + high) / 2) * (2 * FILL / extent)


def _normals(F: Indices, points: Real) -> Real:
    """Return twice the vector area of each triangle, shape (m, 3)."""
    corner = points[F[:, 0]]
    return np.cross(points[F[:, 1]] - corner, points[F[:, 2]] - corner)


def _to_vertices(F: Indices, values: Real, n: int) -> Real:
    """Return the sum of the values of the triangles at each vertex, shape (n,)."""
    total = np.zeros(n)
    for c in range(3):
        total += np.bincount(F[:, c], weights=values, minlength=n)
    return total


def brightness_of(F: Indices, points: Real) -> Real:
    """Return brightness from wrapped lighting: no part is black, so the board stays visible."""
    normals = _normals(F, points)
    smooth = np.stack([_to_vertices(F, normals[:, k], len(points)) for k in range(3)], axis=1)
    length = np.linalg.norm(smooth, axis=1)
    facing = (smooth @ LAMP) / np.where(length > 0, length, 1.0)
    return np.clip(SHADOW + LAMPLIGHT * ((1 + facing) / 2) ** FALL_OFF, 0.0, 1.0)


def fineness_of(F: Indices, space: Real, board: Real) -> Real:
    """Return the depth of subdivision that each vertex needs for squares of the wanted size.

    Shape (n,); not rounded: round up to a whole number.
    """
    n = len(space)
    area = np.linalg.norm(_normals(F, space), axis=1)
    on_board = np.abs(doubled_areas(board[F]))
    weight = np.maximum(_to_vertices(F, area, n), TINY)
    log_side = np.log(weight / np.maximum(_to_vertices(F, on_board, n), TINY)) / 2
    for _ in range(CALMING):
        log_side = _to_vertices(F, area * log_side[F].mean(axis=1), n) / weight
    return np.clip((log_side - np.log(LARGEST_SQUARE)) / np.log(FINER), -1, MAX_LEVELS)
