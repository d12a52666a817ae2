"""Pictures of a path: each frame from the front, the side and between, under one light.

pyvista draws if it can, in a process of its own; else a rasterizer in numpy does, more slowly.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import ParameterError
from cembench.drawing.array_bundle import ArrayBundle
from cembench.drawing.camera import viewpoints
from cembench.drawing.draw_numpy import SAMPLES, averaged
from cembench.drawing.rasterizer import rasterize
from cembench.drawing.scene import FILL, INSIDE, brightness_of, doubled_areas
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.workflows.morphing.path import position

Real = NDArray[np.float64]
Pictures = NDArray[np.uint8]

#: The views there are, in the order of the paper's video.
VIEWS = ("front", "side", "three-quarter")
#: Colour of a surface in full light, each 0 to 1.
CLAY = (0.90, 0.80, 0.71)


@dataclass(frozen=True)
class Film(ArrayBundle):
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
    size : int64 ()
        Pixels along a panel's side.

    """

    F: NDArray[np.int64]
    stops: Real
    times: Real
    rotations: Real
    size: NDArray[np.int64]

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
        return cls(mesh.F, places, times, rotations, np.array(side))

    @property
    def side(self) -> int:
        """Pixels along a panel's side."""
        return int(self.size)

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


def draw_film(
    film: Film, tell: Callable[[int], object] = lambda frame: None
) -> tuple[Pictures, str]:
    """How does each frame look? Pictures uint8 (frames, side, views side, 3), and a notice.

    The notice says why it was not pyvista that drew; else it is empty. `tell` hears of each frame.
    """
    try:
        return _by_pyvista(film, tell), ""
    except (_PyvistaFailed, OSError) as reason:  # a full temporary disk, for one
        pictures = np.empty(film.shape, dtype=np.uint8)
        for k in range(len(film.times)):
            for view in range(len(film.rotations)):
                columns = slice(view * film.side, (view + 1) * film.side)
                pictures[k, :, columns] = draw_by_numpy(film.F, film.in_window(k, view), film.side)
            tell(k)
        return pictures, f"drawn by numpy, which is slow: {reason}"


class _PyvistaFailed(Exception):  # noqa: N818 - a reason to go another way, not an error
    """Pyvista did not draw; the message says why."""


def _by_pyvista(film: Film, tell: Callable[[int], object]) -> Pictures:
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        source, target, log = (Path(folder, name) for name in ("film.npz", "frames.npy", "log"))
        film.save(source)
        command = [
            sys.executable,
            "-m",
            "cembench.workflows.morphing.draw_frames",
            str(source),
            str(target),
        ]
        with (
            log.open("w") as stderr,
            subprocess.Popen(
                command, cwd=folder, stdout=subprocess.PIPE, stderr=stderr, text=True
            ) as process,
        ):
            for line in process.stdout or ():
                tell(int(line))
        if process.returncode:
            said = log.read_text(errors="replace").strip().rpartition("\n")[2] or "no word"
            raise _PyvistaFailed(
                f"pyvista ended with code {process.returncode} ({said}); "
                "`cembench doctor` says what it needs"
            )
        pictures: Pictures = np.load(target)
    if (pictures == 255).all():
        raise _PyvistaFailed("pyvista drew empty pictures; `cembench doctor` says what it needs")
    return pictures


def draw_by_numpy(F: NDArray[np.int64], points: Real, side: int) -> Pictures:
    """How does a surface look, its vertices in window coordinates (n, 3)? uint8 (side, side, 3)."""
    corners = points[F].reshape(-1, 3)
    raster = rasterize(corners, side * SAMPLES)
    light = raster.interpolate(brightness_of(F, points)[F].ravel())
    light = np.where(doubled_areas(corners[:, :2])[raster.face] < 0, INSIDE * light, light)
    shade, white = np.zeros(raster.size**2), np.ones(raster.size**2)
    shade[raster.pixel], white[raster.pixel] = light, 0.0
    shade, white = (averaged(one.reshape(raster.size, raster.size)) for one in (shade, white))
    return np.round(255 * (white[:, :, None] + shade[:, :, None] * np.array(CLAY))).astype(np.uint8)
