"""Draws the frames of a morph with pyvista, in a process of its own: VTK may die without a display.

python -m cembench.workflows.morphing.draw_frames JOB.npz FRAMES.npy

The job holds what :class:`cembench.workflows.morphing.drawing.Film` holds. A line is printed for
each frame.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as _pyvista
from numpy.typing import NDArray

from cembench.drawing.draw_numpy import SAMPLES, shrunk
from cembench.drawing.scene import INSIDE, brightness_of
from cembench.workflows.morphing.drawing import CLAY, Film

#: Its stubs differ from release to release.
pyvista: Any = _pyvista


class Stage:
    """A surface before one camera, whose vertices move."""

    def __init__(self, F: NDArray[np.int64], points: NDArray[np.float64], side: int) -> None:
        self.F = F
        self.plotter: Any = pyvista.Plotter(
            off_screen=True, window_size=[side * SAMPLES] * 2, lighting="none"
        )
        self.plotter.set_background("white")
        # Seen from outside and from inside: two copies, each drawn from one side only.
        self.copies = []
        for culling, light in (("back", 1.0), ("front", INSIDE)):
            copy = pyvista.PolyData.from_regular_faces(points.astype(np.float32), F)
            copy.point_data["light"] = np.zeros((len(points), 3), dtype=np.uint8)
            self.plotter.add_mesh(copy, scalars="light", rgb=True, lighting=False, culling=culling)
            self.copies.append((copy, light))
        camera = self.plotter.camera
        camera.parallel_projection = True
        camera.parallel_scale = 1.0
        camera.focal_point, camera.position, camera.up = (0, 0, 0), (0, 0, 10), (0, 1, 0)
        camera.clipping_range = (0.1, 20.0)

    def picture(self, points: NDArray[np.float64]) -> NDArray[np.uint8]:
        """How does the surface look with its vertices there? Window coordinates (n, 3)."""
        light = brightness_of(self.F, points)[:, None] * np.array(CLAY)
        for copy, share in self.copies:
            copy.points = points.astype(np.float32)
            copy.point_data["light"] = np.round(255 * share * light).astype(np.uint8)
        self.plotter.render()
        seen = self.plotter.screenshot(return_img=True)
        return shrunk(seen[:, :, :3])


def main(arguments: list[str]) -> None:
    """Read a film, write its frames as uint8 (frames, side, views * side, 3)."""
    source, target = map(Path, arguments)
    film = Film.load(source)
    frames = np.lib.format.open_memmap(target, "w+", np.uint8, film.shape)
    stage = Stage(film.F, film.in_window(0, 0), film.side)
    for k in range(len(film.times)):
        for view in range(len(film.rotations)):
            columns = slice(view * film.side, (view + 1) * film.side)
            frames[k, :, columns] = stage.picture(film.in_window(k, view))
        print(k, flush=True)
    frames.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
