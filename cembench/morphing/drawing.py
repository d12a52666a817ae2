"""Frames of a morph, drawn from several views under one light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import ParameterError
from cembench.drawing.camera import viewpoints
from cembench.drawing.painter import draw_clay
from cembench.drawing.scene import FILL
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.morphing.path import position

Real = NDArray[np.float64]
Pictures = NDArray[np.uint8]

#: The available views, in the order of the paper's video.
VIEWS = ("front", "side", "three-quarter")


@dataclass(frozen=True)
class Film:
    """The data for drawing the frames of a path.

    Parameters
    ----------
    F : int64 (m, 3)
        The triangles.
    stops : float64 (s, n, 3)
        The stops of the path, moved and scaled so that every frame fits the panel.
    times : float64 (frames,)
        The time of each frame, 0 to 1.
    rotations : float64 (views, 3, 3)
        The view of each panel, see :func:`cembench.drawing.camera.view_rotation`.
    side : int
        Pixels along a panel's side.

    """

    F: NDArray[np.int64]
    stops: Real
    times: Real
    rotations: Real
    side: int

    @classmethod
    def of(
        cls,
        mesh: TriangleMesh,
        stops: Sequence[Real],
        times: Real,
        views: Sequence[str] = VIEWS,
        side: int = 480,
    ) -> Self:
        """Return the film of a path through these vertex positions (n, 3).

        Raises
        ------
        ParameterError
            An unknown view.

        """
        check_views(views)
        known = viewpoints(mesh)
        rotations = np.stack([known[view] for view in views])
        places = np.stack(stops)
        low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
        places = places - (low + high) / 2
        seen = [np.ptp((at @ r.T)[:, :2], axis=0).max() for at in places for r in rotations]
        apart = [np.abs((at @ r.T)[:, :2]).max() for at in places for r in rotations]
        places *= FILL / max(max(apart), max(seen) / 2)
        return cls(mesh.F, places, times, rotations, side)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Shape of the pictures: frames, rows, columns, 3."""
        return len(self.times), self.side, self.side * len(self.rotations), 3

    def in_window(self, frame: int, view: int) -> Real:
        """Return window coordinates (n, 3): x right and y up from -1 to 1, z to the viewer."""
        return position(self.stops, self.times[frame]) @ self.rotations[view].T


def check_views(views: Sequence[str]) -> None:
    """Raise :class:`ParameterError` if a view is unknown, or there is none."""
    for view in views or [""]:
        if view not in VIEWS:
            raise ParameterError(f"view {view!r} is unknown; allowed: {', '.join(VIEWS)}.")


def draw_film(film: Film, tell: Callable[[int], object] = lambda frame: None) -> Pictures:
    """Draw each frame; return pictures, uint8 (frames, side, views * side, 3).

    `tell` is called with each frame number.
    """
    pictures = np.empty(film.shape, dtype=np.uint8)
    for k in range(len(film.times)):
        for view in range(len(film.rotations)):
            columns = slice(view * film.side, (view + 1) * film.side)
            pictures[k, :, columns] = draw_clay(film.F, film.in_window(k, view), film.side)
        tell(k)
    return pictures
