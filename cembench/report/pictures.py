"""Embed pictures in a self-contained page that is small enough to send."""

from __future__ import annotations

import base64
import gzip
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from cembench.core.errors import RenderError

#: Maximum pixels of all pictures of a page together: at 0.11 bytes each (for small pictures of
#: meshes and checkerboards; large, smooth ones take half) about 0.7 MB, and a third more as text.
PIXELS = 6_000_000
#: Pixels along the longer side of a picture.
LONGEST = 1600
#: WebP quality at which the edges of a checkerboard are still clean, and of the transparency.
QUALITY, ALPHA_QUALITY = 66, 30
#: A pixel with all channels at least this bright is white background.
WHITE = 234
#: Isolated spots below this share of a picture are JPEG artefacts.
SPECK = 2e-4
#: Maximum compressed bytes of an embedded vector graphic; one with many marks is larger than its
#: pixels.
VECTOR_BYTES = 40_000
#: CSS pixels per unit of an SVG's size.
_SVG_UNITS = {"pt": 4 / 3, "px": 1.0, "": 1.0, "in": 96.0, "mm": 96 / 25.4, "cm": 96 / 2.54}


#: Suffixes of the pictures that a report takes, by Pillow's name of the format.
_SUFFIXES = {"PNG": ".png", "JPEG": ".jpg", "WEBP": ".webp"}
#: Errors of Pillow for a file that is no picture, or one of too many pixels.
_NO_PICTURE = (OSError, Image.DecompressionBombError)


@dataclass(frozen=True)
class Embedded:
    """A picture as the text of an SVG or as a data URI, with its width and height in pixels."""

    width: int
    height: int
    uri: str = ""
    svg: str = ""


def pixel_cap(sizes: Sequence[tuple[int, int]], budget: int = PIXELS) -> float:
    """Return the maximum pixels per picture that keeps all together within the budget.

    Small pictures keep all their pixels; the rest of the budget is shared equally by the others.
    """
    areas = sorted(width * height for width, height in sizes)
    left = float(budget)
    for done, area in enumerate(areas):
        share = left / (len(areas) - done)
        if area > share:
            return share
        left -= area
    return float("inf")


def pixel_suffix(content: bytes) -> str | None:
    """Return the suffix for a picture of pixels, by its content; None if it is something else."""
    try:
        with Image.open(io.BytesIO(content), formats=tuple(_SUFFIXES)) as picture:
            return _SUFFIXES[str(picture.format)]
    except (*_NO_PICTURE, SyntaxError, ValueError):
        return None


def size_of(path: Path) -> tuple[int, int]:
    """Return the width and height of a picture file in pixels."""
    try:
        with Image.open(path) as picture:
            return picture.size
    except _NO_PICTURE as error:
        raise unreadable(path, error) from error


def embed_pixels(path: Path, cap: float, *, exact: bool) -> Embedded:
    """Return a PNG or JPEG as WebP of at most `cap` pixels; `exact` keeps the lines of plots clean.

    Raises
    ------
    RenderError
        The file does not exist, or is not a picture.
    """
    try:
        with Image.open(path) as opened:
            picture = opened.convert("RGBA" if "A" in opened.getbands() else "RGB")
    except _NO_PICTURE as error:
        raise unreadable(path, error) from error
    if not exact and "A" not in picture.getbands():
        picture = with_transparent_background(picture)
    scale = min(1.0, LONGEST / max(picture.size), (cap / (picture.width * picture.height)) ** 0.5)
    if scale < 1:
        smaller = (max(1, round(side * scale)) for side in picture.size)
        picture = picture.resize(tuple(smaller), Image.Resampling.LANCZOS)
    file = io.BytesIO()
    quality = {"quality": QUALITY, "alpha_quality": ALPHA_QUALITY}
    picture.save(file, "WEBP", lossless=exact, method=6, **quality)
    content = base64.b64encode(file.getvalue()).decode()
    return Embedded(*picture.size, uri=f"data:image/webp;base64,{content}")


def with_transparent_background(picture: Image.Image) -> Image.Image:
    """Make the white background of a picture transparent, for dark pages.

    White areas that are not connected to the border stay white.
    """
    pixels = np.asarray(picture)
    white = pixels.min(axis=2) >= WHITE
    label, _ = ndimage.label(white)
    rims = np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]])
    ground = white & np.isin(label, np.unique(rims[rims > 0]))
    island, count = ndimage.label(~ground, structure=np.ones((3, 3)))
    sizes = np.bincount(island.ravel(), minlength=count + 1)
    ground |= (sizes < max(SPECK * ground.size, 4))[island]
    near = ndimage.binary_dilation(ground) & ~ground
    opacity = np.where(ground, 0, np.where(near, 128, 255)).astype(np.uint8)
    return Image.fromarray(np.dstack([pixels, opacity]), "RGBA")


def embed_vector(path: Path) -> Embedded | None:
    """Return an SVG unchanged; None if it is too large or does not state its size."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error
    if len(gzip.compress(content)) > VECTOR_BYTES:
        return None
    head = re.search(r"<svg\b[^>]*>", content[:4000].decode(errors="replace"))
    sides = [_svg_side(head.group(0), side) for side in ("width", "height")] if head else [None]
    width, height = sides[0], sides[-1]
    if width is None or height is None:
        return None
    return Embedded(round(width), round(height), svg=content.decode(errors="replace"))


def _svg_side(head: str, side: str) -> float | None:
    match = re.search(rf'\s{side}="([\d.]+)([a-z]*)"', head)
    unit = _SVG_UNITS.get(match.group(2)) if match else None
    return float(match.group(1)) * unit if match and unit else None


def unreadable(path: Path, error: Exception) -> RenderError:
    """Return the error for an unreadable file of a report."""
    return RenderError(
        f"The report names {path}, which cannot be read: "
        f"{getattr(error, 'strerror', None) or error}. "
        "Its figures are written before its pages; write the whole report again."
    )
