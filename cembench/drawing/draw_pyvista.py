"""Draws a scene with pyvista; run as a process of its own, because VTK may die without a display.

python -m cembench.drawing.draw_pyvista SCENE.npz PICTURES.npz SIDE
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as _pyvista
from numpy.typing import NDArray

from cembench.drawing import scene as look
from cembench.drawing.draw_numpy import SAMPLES, shrunk
from cembench.drawing.scene import Scene, View

Picture = NDArray[np.uint8]
#: Its stubs differ from release to release.
pyvista: Any = _pyvista

#: Pixels of one square in the texture: enough for sharp edges where a square fills the panel.
TEXELS = 64
#: Width of the rim round a fold, in samples.
RIM = 2.0 * SAMPLES


def draw(scene: Scene, side: int) -> tuple[Picture, Picture]:
    """How do the surface and its image look? Two pictures uint8 (side, side, 3), on white."""
    return _drawn(scene, scene.surface, side), _drawn(scene, scene.image, side)


def _drawn(scene: Scene, view: View, side: int) -> Picture:
    plotter: Any = pyvista.Plotter(
        off_screen=True, window_size=[side * SAMPLES] * 2, lighting="none"
    )
    plotter.set_background("white")
    folded = np.repeat(scene.folded, 3)
    _add_board(plotter, view, scene.board, ~folded)
    _add_folds(plotter, view, folded)
    _look_at(plotter, view)
    picture = plotter.screenshot(return_img=True)
    plotter.close()
    return shrunk(picture[:, :, :3])


def _triangles(corners: NDArray[np.float64]) -> Any:
    faces = np.arange(len(corners)).reshape(-1, 3)
    return pyvista.PolyData.from_regular_faces(corners.astype(np.float32), faces)


def _grey(brightness: NDArray[np.float64]) -> Picture:
    return np.repeat(np.round(255 * brightness).astype(np.uint8)[:, None], 3, axis=1)


def _add_board(
    plotter: Any,
    view: View,
    board: NDArray[np.float64],
    chosen: NDArray[np.bool_],
) -> None:
    """The texture multiplies the light, so both are exact at every pixel."""
    if not chosen.any():
        return
    mesh = _triangles(view.corners[chosen])
    mesh.point_data["light"] = _grey(view.brightness[chosen])
    # One period of the texture is two squares; whole periods are taken off for single precision.
    periods = (board[chosen] / 2).reshape(-1, 3, 2)
    periods -= np.floor(periods.min(axis=1, keepdims=True))
    mesh.active_texture_coordinates = periods.reshape(-1, 2).astype(np.float32)
    plotter.add_mesh(mesh, texture=_texture(), scalars="light", rgb=True, lighting=False)


def _texture() -> Any:
    """Two by two squares, repeated, and averaged where they are too small to be told apart."""
    row = np.arange(2 * TEXELS) // TEXELS
    dark = (row[:, None] + row[None, :]) % 2 == 0  # a texture's first row is its last
    colours = np.where(dark[:, :, None], look.DARK, look.LIGHT)
    texture = pyvista.numpy_to_texture(np.round(255 * colours).astype(np.uint8))
    texture.repeat = True
    texture.mipmap = True
    texture.interpolate = True
    texture.SetMaximumAnisotropicFiltering(8.0)
    return texture


def _add_folds(plotter: Any, view: View, folded: NDArray[np.bool_]) -> None:
    if not folded.any():
        return
    mesh = _triangles(view.corners[folded])
    mesh.point_data["light"] = np.round(
        255 * view.brightness[folded, None] * np.array(look.FOLDED)
    ).astype(np.uint8)
    plotter.add_mesh(mesh, scalars="light", rgb=True, lighting=False)
    # A fold may be smaller than a pixel.
    plotter.add_mesh(
        mesh.copy(), style="wireframe", color=look.FOLDED, line_width=RIM, lighting=False
    )


def _look_at(plotter: Any, view: View) -> None:
    """Along -z, so that window coordinates from -1 to 1 fill the picture."""
    camera = plotter.camera
    camera.parallel_projection = True
    camera.parallel_scale = 1.0
    camera.focal_point = (0.0, 0.0, 0.0)
    camera.position = (0.0, 0.0, float(view.corners[:, 2].max()) + 1.0)
    camera.up = (0.0, 1.0, 0.0)
    plotter.reset_camera_clipping_range()


def main(arguments: list[str]) -> None:
    """Read a scene, write the two pictures."""
    source, target, side = arguments
    surface, image = draw(Scene.load(Path(source)), int(side))
    np.savez(target, surface=surface, image=image)


if __name__ == "__main__":
    main(sys.argv[1:])
