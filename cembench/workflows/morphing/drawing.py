"""Pictures of a path: each frame from the front, the side and between, under one light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import ParameterError
from cembench.drawing.camera import viewpoints
from cembench.drawing.clay import draw_clay
from cembench.drawing.scene import FILL
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.workflows.morphing.path import position

Real = NDArray[np.float64]
Pictures = NDArray[np.uint8]

#: The views there are, in the order of the paper's video.
VIEWS = ("front", "side", "three-quarter")


@dataclass(frozen=True)
class Film:
    """All that is needed to draw the frames of a path.

    Parameters
    ----------
    F : int64 (m, 3)
        The triangles.
    stops : float64 (s, n, 3)
        What the path goes through, moved and scaled so that every frame fits the panel.
    times : float64 (frames,)
        The time of each frame, 0 to 1.
    rotations : float64 (views, 3, 3)
        From where each panel looks, as :func:`cembench.drawing.camera.view_rotation`.
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
        """The film of a path through these positions (n, 3) of the vertices of a mesh.

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
        """Window coordinates (n, 3) of the vertices: x right, y up, -1 to 1, z to the viewer."""
        return position(self.stops, self.times[frame]) @ self.rotations[view].T


def check_views(views: Sequence[str]) -> None:
    """Raise :class:`ParameterError` where there is no such view, or none at all."""
    for view in views or [""]:
        if view not in VIEWS:
            raise ParameterError(f"view {view!r} is unknown; allowed: {', '.join(VIEWS)}.")


def draw_film(film: Film, tell: Callable[[int], object] = lambda frame: None) -> Pictures:
    """How does each frame look? Pictures uint8 (frames, side, views side, 3).

    `tell` hears of each frame.
    """
    pictures = np.empty(film.shape, dtype=np.uint8)
    for k in range(len(film.times)):
        for view in range(len(film.rotations)):
            columns = slice(view * film.side, (view + 1) * film.side)
            pictures[k, :, columns] = draw_clay(film.F, film.in_window(k, view), film.side)
        tell(k)
    return pictures
