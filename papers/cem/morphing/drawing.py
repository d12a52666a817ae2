"""Frames of a morph, drawn from several views under one light."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Real
from cembench.core.errors import ParameterError
from cembench.drawing.camera import viewpoints
from cembench.drawing.painter import draw_clay
from cembench.drawing.scene import FILL
from cembench.mesh.triangle_mesh import TriangleMesh

from .path import position

Pictures = NDArray[np.uint8]

#: The available views, in the order of the paper's video.
VIEWS = ("front", "side", "three-quarter")


def check_views(views: Sequence[str]) -> None:
    """Raise :class:`ParameterError` if a view is unknown, or there is none."""
    for view in views or [""]:
        if view not in VIEWS:
            raise ParameterError(f"view {view!r} is unknown; allowed: {', '.join(VIEWS)}.")


def fitted_views(
    mesh: TriangleMesh, stops: Sequence[Real], views: Sequence[str]
) -> tuple[Real, Real]:
    """Return the stops of a path, moved and scaled so that every frame fits its panel, and views.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface that the views are of.
    stops : sequence of float64 (n, 3)
        The vertices at the stops.
    views : sequence of str
        Some of :data:`VIEWS`.

    Returns
    -------
    stops : float64 (s, n, 3)
    rotations : float64 (views, 3, 3)
        The view of each panel, see :func:`cembench.drawing.camera.view_rotation`.

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
    return places * (FILL / max(max(apart), max(seen) / 2)), rotations


def draw_film(
    mesh: TriangleMesh,
    stops: Sequence[Real],
    times: Real,
    views: Sequence[str] = VIEWS,
    side: int = 480,
    tell: Callable[[int], object] = lambda frame: None,
) -> Pictures:
    """Draw a path at each time; return pictures, uint8 (frames, side, views * side, 3).

    The stops are vertices of the mesh (n, 3); `tell` is called with each frame number.
    """
    places, rotations = fitted_views(mesh, stops, views)
    pictures = np.empty((len(times), side, side * len(views), 3), dtype=np.uint8)
    for k, time in enumerate(times):
        at = position(places, time)
        panels = [draw_clay(mesh.F, at @ rotation.T, side) for rotation in rotations]
        pictures[k] = np.concatenate(panels, axis=1)
        tell(k)
    return pictures
