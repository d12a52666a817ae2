"""A picture in which a person sees at a glance whether a map keeps squares square.

On the left the surface under a checkerboard that was pulled back by the map, on the right the image
under the same checkerboard, turned so that what is up on the surface is up in it. The board has 18
squares across the image; a square that would be large on the surface is divided into 3 x 3, as
often as needed, in both panels alike (the conformal factor of one map can range over a factor of
thousands).

A rasterizer in numpy draws, so that no graphics card or display is needed and the same map gives
the same bytes; Pillow puts the page together.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes
from cembench.core.errors import ParameterError, RenderError
from cembench.drawing import compose, draw_numpy
from cembench.drawing.checkerboard import FINER
from cembench.drawing.scene import Scene, image_in_window
from cembench.drawing.view_scene import upright
from cembench.mesh.triangle_mesh import TriangleMesh

Complex = NDArray[np.complex128]
Picture = NDArray[np.uint8]

#: Width and height in pixels, and the smallest that can hold two panels and words.
SIZE, LEAST = (1280, 752), (240, 150)
#: Side in pixels of a picture of the surface alone.
THUMBNAIL = 480


def write_preview(
    mesh: TriangleMesh,
    uv: Complex,
    path: Path,
    *,
    title: str = "",
    caption: str = "",
    size: tuple[int, int] = SIZE,
    turned: bool = True,
) -> None:
    """Draw a surface and its image under one checkerboard into a PNG file.

    Triangles that the map folds over are red in both panels, and ringed where they are small.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface; holes are no matter.
    uv : complex128 (n,)
        Image of each vertex, in a disk or not.
    path : Path
        Where to write; an older file is replaced in one step, or left alone on failure.
    title, caption : str
        Words below the picture; broken into two lines where they are long.
    size : tuple of int
        Width and height of the picture in pixels.
    turned : bool
        Whether the image is turned so that what is up on the surface is up in it.

    Raises
    ------
    ParameterError
        A map of the wrong shape or with values that are not finite; a size that is too small.
    RenderError
        The file cannot be written, or the picture cannot be drawn.

    """
    png = preview_png(mesh, uv, title=title, caption=caption, size=size, turned=turned)
    write_bytes(path, png, error=RenderError, parents=False)


def preview_png(
    mesh: TriangleMesh,
    uv: Complex,
    *,
    title: str = "",
    caption: str = "",
    size: tuple[int, int] = SIZE,
    turned: bool = True,
) -> bytes:
    """Return the picture of :func:`write_preview` as PNG."""
    _check(mesh, uv, size)
    uv = upright(mesh, uv) if turned else uv
    scene = Scene.of(mesh, uv)
    surface, image = _draw(scene, compose.side_of(size))
    outline = image_in_window(uv)[:, :2]
    overlay = compose.Overlay(tuple(outline[loop] for loop in mesh.loops), scene.small_folds)
    return compose.page(
        surface, image, overlay, (title, caption, _note(scene, turned=turned)), size
    )


def write_thumbnail(mesh: TriangleMesh, uv: Complex, path: Path, *, side: int = THUMBNAIL) -> None:
    """Draw a surface under the checkerboard of its map into a PNG file.

    `side` in pixels; the rest, errors too, as in :func:`write_preview`.
    """
    _check(mesh, uv, SIZE)
    surface, _ = _draw(Scene.of(mesh, uv), side)
    write_bytes(path, compose.png(surface), error=RenderError, parents=False)


def draw_panels(mesh: TriangleMesh, uv: Complex, side: int) -> tuple[Picture, Picture]:
    """How do a surface and its image look under one checkerboard? uint8 (side, side, 3) each.

    Raises what :func:`write_preview` raises, except for files.
    """
    _check(mesh, uv, SIZE)
    return _draw(Scene.of(mesh, uv), side)


def _check(mesh: TriangleMesh, uv: Complex, size: tuple[int, int]) -> None:
    if uv.shape != (mesh.n,):
        raise ParameterError(
            f"the map has shape {uv.shape}; allowed is ({mesh.n},), one image a vertex."
        )
    bad = np.flatnonzero(~np.isfinite(uv))
    if len(bad):
        raise ParameterError(
            f"the map is NaN or infinite at {len(bad)} of {mesh.n} vertices, the first being "
            f"{bad[0]} (counted from 0); a picture needs finite values."
        )
    if size[0] < LEAST[0] or size[1] < LEAST[1] or compose.side_of(size) < 64:
        raise ParameterError(
            f"size {size[0]} x {size[1]} leaves no room for two panels and words; allowed is "
            f"{LEAST[0]} x {LEAST[1]} and above."
        )


def _note(scene: Scene, *, turned: bool) -> str:
    up = "The image is turned so that up on the surface is up in it." if turned else ""
    finer = (
        f"Squares that would be large on the surface are divided {FINER} by {FINER}, in both "
        "panels alike."
    )
    return f"{up} {finer if scene.squares.is_divided else ''}".strip()


def _draw(scene: Scene, side: int) -> tuple[Picture, Picture]:
    try:
        return draw_numpy.draw(scene, side)
    except (MemoryError, ArithmeticError, ValueError, IndexError) as error:
        raise RenderError(
            f"the picture could not be drawn: {type(error).__name__}: {error}"
        ) from error
