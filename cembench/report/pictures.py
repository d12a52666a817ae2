"""Pictures as parts of a page that travels alone: small enough to send, and no file beside it."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from cembench.core.errors import RenderError

#: Pixels of all pictures of a page together: at 0.13 bytes each (small pictures of meshes and
#: checkerboards; large and smooth ones take half) about 2.5 MB, and a third more as text.
PIXELS = 12_000_000
#: Pixels along the longer side of one picture, and what a thumbnail has.
LONGEST, THUMBNAIL = 1600, 360
#: Quality of WebP at which a checkerboard's edges are still clean.
QUALITY = 76
#: A pixel whose channels are all as bright as this is the white that a picture stands on.
WHITE = 234
#: What is smaller than this share of a picture and lies alone on its ground is JPEG's doing.
SPECK = 2e-4
#: Bytes up to which a vector graphic is embedded as it is; one of many marks outgrows its pixels.
VECTOR_BYTES = 55_000
#: CSS pixels of the units that an SVG's size is given in.
_SVG_UNITS = {"pt": 4 / 3, "px": 1.0, "": 1.0, "in": 96.0, "mm": 96 / 25.4, "cm": 96 / 2.54}


@dataclass(frozen=True)
class Embedded:
    """A picture as a data URI, with the width and height it asks for, in pixels."""

    uri: str
    width: int
    height: int


def data_uri(content: bytes, media_type: str) -> str:
    """Content as an address that holds it."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


def pixel_cap(sizes: Sequence[tuple[int, int]], budget: int = PIXELS) -> float:
    """How many pixels may each picture keep, so that all together keep within the budget?

    Small pictures keep all they have; what they leave is shared equally by the others.
    """
    areas = sorted(width * height for width, height in sizes)
    left = float(budget)
    for done, area in enumerate(areas):
        share = left / (len(areas) - done)
        if area > share:
            return share
        left -= area
    return float("inf")


def size_of(path: Path) -> tuple[int, int]:
    """Width and height of a picture's file in pixels."""
    try:
        with Image.open(path) as picture:
            return picture.size
    except OSError as error:
        raise unreadable(path, error) from error


def embed_pixels(path: Path, cap: float, *, longest: int = LONGEST, exact: bool) -> Embedded:
    """A PNG or JPEG as WebP of at most `cap` pixels; `exact` for plots, whose lines stay clean.

    Raises
    ------
    RenderError
        The file is not there, or is no picture.

    """
    try:
        with Image.open(path) as opened:
            picture = opened.convert("RGBA" if "A" in opened.getbands() else "RGB")
    except OSError as error:
        raise unreadable(path, error) from error
    if not exact and "A" not in picture.getbands():
        picture = on_any_ground(picture)
    scale = min(1.0, longest / max(picture.size), (cap / (picture.width * picture.height)) ** 0.5)
    if scale < 1:
        smaller = (max(1, round(side * scale)) for side in picture.size)
        picture = picture.resize(tuple(smaller), Image.Resampling.LANCZOS)
    file = io.BytesIO()
    picture.save(file, "WEBP", quality=QUALITY, lossless=exact, method=4)
    return Embedded(data_uri(file.getvalue(), "image/webp"), picture.width, picture.height)


def on_any_ground(picture: Image.Image) -> Image.Image:
    """Make the white that a picture stands on transparent, so that it stands on a dark page too.

    White inside, which no way over white joins with the rim, stays.
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
    """An SVG as it is; None if it is too large for that or does not say its size."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error
    if len(content) > VECTOR_BYTES:
        return None
    head = re.search(r"<svg\b[^>]*>", content[:4000].decode(errors="replace"))
    sides = [_svg_side(head.group(0), side) for side in ("width", "height")] if head else [None]
    width, height = sides[0], sides[-1]
    if width is None or height is None:
        return None
    return Embedded(data_uri(content, "image/svg+xml"), round(width), round(height))


def _svg_side(head: str, side: str) -> float | None:
    found = re.search(rf'\s{side}="([\d.]+)([a-z]*)"', head)
    unit = _SVG_UNITS.get(found.group(2)) if found else None
    return float(found.group(1)) * unit if found and unit else None


def unreadable(path: Path, error: OSError) -> RenderError:
    """What to say of a file that a report names and that cannot be read."""
    return RenderError(
        f"The report names {path}, which cannot be read: {error.strerror or error}. "
        "Its figures are written before its pages; write the whole report again."
    )
