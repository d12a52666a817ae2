"""Bake a texture for new texture coordinates."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from cembench.core.arrays import Indices, Points, Real, marked
from cembench.core.errors import MeshError, RenderError
from cembench.drawing.rasterizer import rasterize
from cembench.mesh.files import read_soup
from cembench.mesh.soup import columns

#: Longest side of a baked texture, in pixels.
LONGEST = 4096


def read_texture(path: Path) -> Image.Image:
    """Read a picture as RGBA.

    Raises
    ------
    RenderError
        The file is missing or is not a picture.
    """
    try:
        with Image.open(path) as picture:
            return picture.convert("RGBA")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        why = getattr(error, "strerror", None) or "it is not a picture in a known format"
        raise RenderError(
            f"the texture {path} cannot be read: {why}. Name a PNG or JPEG file."
        ) from None


def baked_png(texture: Image.Image, old: Real, new: Real) -> bytes:
    """Bake a texture for new texture coordinates.

    Each texel of the new texture takes the colour that the old texture has at the same point of the
    surface; texels outside the map take that of the nearest texel inside.

    Parameters
    ----------
    texture : Image
        The old texture.
    old, new : float64 (m, 3, 2)
        Texture coordinates at the triangles' corners; v points up. The old ones may lie outside the
        unit square, where the texture repeats.

    Returns
    -------
    bytes
        A square PNG file whose side is the old texture's longer side (at most :data:`LONGEST`).
    """
    side = min(max(texture.size), LONGEST)
    window = np.concatenate([2 * new - 1, np.zeros((*new.shape[:2], 1))], axis=2)
    raster = rasterize(window.reshape(-1, 3), side)
    place = raster.interpolate(old.reshape(-1, 2))
    colours = np.zeros((side * side, 4))
    colours[raster.pixel] = _bilinear(np.asarray(texture, dtype=np.float64), place)
    missing = ~marked(side * side, raster.pixel)
    nearest = ndimage.distance_transform_edt(
        missing.reshape(side, side), return_distances=False, return_indices=True
    )
    filled = colours.reshape(side, side, 4)[tuple(nearest)]
    return _png(Image.fromarray(filled.round().astype(np.uint8), "RGBA"))


def _bilinear(pixels: Real, place: Real) -> Real:
    """Return the colours (k, 4) at texture coordinates (k, 2), with bilinear interpolation."""
    height, width = pixels.shape[:2]
    x = place[:, 0] * width - 0.5
    y = (1 - place[:, 1]) * height - 0.5
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    s, t = (x - column)[:, None], (y - row)[:, None]

    def at(down: int, right: int) -> Real:
        return pixels[(row + down) % height, (column + right) % width]

    upper = (1 - s) * at(0, 0) + s * at(0, 1)
    lower = (1 - s) * at(1, 0) + s * at(1, 1)
    return (1 - t) * upper + t * lower


def _png(picture: Image.Image) -> bytes:
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def uv_of_faces(path: Path, F: Indices) -> Points:
    """Read the texture coordinates of an OBJ file at the corners of its triangles.

    Parameters
    ----------
    path : Path
        A file that was read as a surface.
    F : int64 (m, 3)
        The triangles of that surface: the file's polygons in order, cut into triangles.

    Returns
    -------
    float64 (m, 3, 2)
        As in the file; v points up.

    Raises
    ------
    MeshError
        The file is not OBJ, or some corners have no texture coordinates.
    """
    if path.suffix.lower() != ".obj":
        raise MeshError(
            f"{path}: the texture coordinates that a texture was made for are read from OBJ files "
            "only. Convert the surface to OBJ."
        )
    file = read_soup(path, uv=True)
    assert file.uv is not None
    if len(file.triangles) != len(F):
        raise _other_faces(path)
    corners = file.uv_triangles
    missing = (corners < 0) | (corners >= len(file.uv))
    if missing.any():
        raise MeshError(
            f"{path}: {missing.any(axis=1).sum()} of {len(F)} triangles have no texture coordinates"
            " (vt), so there is no texture to transfer. Name the file that the texture belongs to."
        )
    not_finite = np.flatnonzero(~np.isfinite(file.uv))
    if len(not_finite):
        raise MeshError(
            f"{path}: texture coordinate {not_finite[0] + 1} (the first vt is 1) is not finite."
        )
    matches = F[:, :, None] == file.triangles[:, None, :]  # checks may have reversed a triangle
    if not matches.any(axis=2).all():
        raise _other_faces(path)
    return columns(file.uv)[np.take_along_axis(corners, matches.argmax(axis=2), axis=1)]


def _other_faces(path: Path) -> MeshError:
    return MeshError(f"{path}: its faces are not those of the surface; map it without `repair`.")
