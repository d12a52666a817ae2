"""Previews: a picture that shows at a glance whether a map keeps squares square.

On the left is the surface under a checkerboard pulled back by the map; on the right is the image
under the same checkerboard, turned so that up on the surface is up in the image. The board has 18
squares across the image. A square that would be large on the surface is divided into 3 x 3, as
often as needed and in both panels alike, since the conformal factor of one map can vary by a factor
of thousands.

A rasterizer in numpy draws the panels, so no graphics card or display is needed and the same map
gives the same bytes; Pillow composes the page.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cembench.conformal.metrics import angle_errors
from cembench.core.arrays import Complex, Mask, Picture
from cembench.core.atomic import write_bytes
from cembench.core.errors import ParameterError, RenderError
from cembench.drawing import compose, painter, scene
from cembench.drawing.checkerboard import FINER
from cembench.drawing.view_scene import upright
from cembench.mesh.triangle_mesh import TriangleMesh

#: Default width and height in pixels, and the smallest that hold two panels and text.
SIZE, LEAST = (1280, 752), (240, 150)
#: Side of a thumbnail of the surface alone, in pixels.
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

    Triangles that the map folds over are red in both panels, and ringed if they are small.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface, with or without holes.
    uv : complex128 (n,)
        Image of each vertex, in a disk or not.
    path : Path
        The PNG file; an existing file is replaced in one step, or kept on failure.
    title, caption : str
        Text below the picture; long text is broken into two lines.
    size : tuple of int
        Width and height of the picture in pixels.
    turned : bool
        Whether to turn the image so that up on the surface is up in it.

    Raises
    ------
    ParameterError
        The map has the wrong shape or values that are not finite, or the size is too small.
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
    """Return the picture of :func:`write_preview` as the bytes of a PNG file."""
    _check(mesh, uv, size)
    uv = upright(mesh, uv) if turned else uv
    surface, image, board = _draw(mesh, uv, compose.panel_side(size))
    outline = scene.image_in_window(uv)[:, :2]
    loops = tuple(outline[loop] for loop in mesh.loops)
    overlay = compose.Overlay(loops, scene.small_folds(uv, mesh.F[scene.folded_by(uv, mesh.F)]))
    words = (title, caption, _note(board.squares.depth, turned=turned))
    return compose.page(surface, image, overlay, words, size)


def write_distortion(
    mesh: TriangleMesh, uv: Complex, folded: Mask, path: Path, words: tuple[str, str]
) -> None:
    """Draw a surface and its image, coloured by the angle error, into a PNG file.

    White is none, dark red :data:`~cembench.drawing.painter.ANGLE_SCALE` degrees or more in the
    mean of a triangle's corners. The triangles that are `folded` (m,) are drawn as in
    :func:`write_preview`, whose errors it raises; `words` are a title and a caption.
    """
    _check(mesh, uv, SIZE)
    space, side = scene.surface_in_window(mesh), compose.panel_side(SIZE)
    colouring = painter.angle_colours(angle_errors(mesh, uv).mean(axis=1))
    surface, image = (
        painter.paint(panel, colouring, folded)
        for panel in (
            painter.surface_panel(mesh.F, space, side),
            painter.image_panel(mesh.F, space, uv, folded, side),
        )
    )
    overlay = compose.Overlay((), scene.small_folds(uv, mesh.F[folded]))
    note = f"Angle error: white 0, dark red {painter.ANGLE_SCALE:.0f} degrees and above."
    png = compose.page(surface, image, overlay, (*words, note), SIZE)
    write_bytes(path, png, error=RenderError, parents=False)


def write_thumbnail(mesh: TriangleMesh, uv: Complex, path: Path, *, side: int = THUMBNAIL) -> None:
    """Draw a surface under the checkerboard of its map into a PNG file.

    `side` is in pixels; other arguments and errors as for :func:`write_preview`.
    """
    _check(mesh, uv, SIZE)
    surface, _, _ = _draw(mesh, uv, side)
    write_bytes(path, compose.png(surface), error=RenderError, parents=False)


def draw_panels(mesh: TriangleMesh, uv: Complex, side: int) -> tuple[Picture, Picture]:
    """Draw a surface and its image under one checkerboard; uint8 (side, side, 3) each.

    Raises the errors of :func:`write_preview`, except those about files.
    """
    _check(mesh, uv, SIZE)
    surface, image, _ = _draw(mesh, uv, side)
    return surface, image


def _check(mesh: TriangleMesh, uv: Complex, size: tuple[int, int]) -> None:
    """Raise :class:`ParameterError` for a map or a size that cannot be drawn."""
    if uv.shape != (mesh.n,):
        raise ParameterError(
            f"the map has shape {uv.shape}; allowed is ({mesh.n},), one image per vertex."
        )
    bad = np.flatnonzero(~np.isfinite(uv))
    if len(bad):
        raise ParameterError(
            f"the map is NaN or infinite at {len(bad)} of {mesh.n} vertices, the first being "
            f"{bad[0]} (counted from 0); a picture needs finite values."
        )
    if size[0] < LEAST[0] or size[1] < LEAST[1] or compose.panel_side(size) < 64:
        raise ParameterError(
            f"size {size[0]} x {size[1]} is too small for two panels and their captions; allowed "
            f"is {LEAST[0]} x {LEAST[1]} and above."
        )


def _note(depth: int, *, turned: bool) -> str:
    """Return the note below a picture on how it was drawn."""
    up = "The image is turned so that up on the surface is up in it." if turned else ""
    finer = (
        f"Squares that would be large on the surface are divided {FINER} by {FINER}, in both "
        f"panels alike; the smallest are 1/{FINER**depth:,} as wide."
    )
    return f"{up} {finer if depth else ''}".strip()


def _draw(mesh: TriangleMesh, uv: Complex, side: int) -> tuple[Picture, Picture, scene.Board]:
    try:
        return painter.under_checkerboard(mesh, uv, side)
    except (MemoryError, ArithmeticError, ValueError, IndexError) as error:
        raise RenderError(
            f"the picture could not be drawn: {type(error).__name__}: {error}"
        ) from error
