"""Compose a preview page: two panels, the boundary of the image, and captions."""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

from cembench.core.arrays import Picture
from cembench.drawing.replaceable_pictures import SOFTWARE
from cembench.drawing.scene import FOLDED


@dataclass(frozen=True)
class Style:
    """A line of text: position from the bottom, size in pixels, colour and weight."""

    place: float
    pixels: int
    colour: str
    bold: bool = False


#: Pixels between and around the panels, and for the text below them, at the size 1600 x 940.
GAP, WORDS, DESIGN_WIDTH = 40, 160, 1600
#: The lines of text, placed by their centres.
TITLE = Style(0.72, 30, "#1a2733", bold=True)
CAPTION = Style(0.42, 23, "#33475a")
NOTE = Style(0.13, 17, "#7a8894")
INK = "#22384d"
#: Diameter of a ring around a fold, in line widths.
RING = 7.0
#: Long text is shrunk to the first share of its size, then broken into two lines and shrunk to the
#: second, before it is cut.
EASY, SMALLEST = 0.85, 0.6
#: Line height, in font sizes.
LINE = 1.32
#: Samples along each side of a pixel for lines; PNG compression level.
SAMPLES, COMPRESSION = 3, 4


def panel_gap(size: tuple[int, int]) -> int:
    """Return the white space around the panels, in pixels."""
    return round(GAP * size[0] / DESIGN_WIDTH)


def panel_side(size: tuple[int, int]) -> int:
    """Return the side of a panel in pixels, for a page of this width and height."""
    gap, words = panel_gap(size), round(WORDS * size[0] / DESIGN_WIDTH)
    return min((size[0] - 3 * gap) // 2, size[1] - gap - words)


def panels_of(size: tuple[int, int]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the column and row of the upper left pixels of the surface and image panels."""
    gap, side = panel_gap(size), panel_side(size)
    left = (size[0] - 2 * side - gap) // 2
    return (left, gap), (left + side + gap, gap)


@dataclass(frozen=True)
class Overlay:
    """Marks drawn over the image; points float64 (k, 2) in window coordinates, -1 to 1.

    Parameters
    ----------
    curves : tuple of array
        Closed curves; the first point is not repeated.
    marks : array
        Points to be ringed in red.
    """

    curves: tuple[NDArray[np.float64], ...]
    marks: NDArray[np.float64]


def page(
    surface: Picture,
    image: Picture,
    overlay: Overlay,
    words: tuple[str, str, str],
    size: tuple[int, int],
) -> bytes:
    """Return the PNG file of a page with two pictures.

    Parameters
    ----------
    surface, image : uint8 (side, side, 3)
        The pictures, of the size that :func:`panel_side` returns.
    overlay : Overlay
        Marks drawn over the image.
    words : tuple of str
        Title, caption and a note; each may be empty.
    size : tuple of int
        Width and height of the page in pixels.
    """
    whole = Image.new("RGB", size, "white")
    for picture, corner in zip((surface, image), panels_of(size), strict=True):
        whole.paste(Image.fromarray(picture), corner)
    _add_overlay(whole, overlay, size)
    for text, style in zip(words, (TITLE, CAPTION, NOTE), strict=True):
        _add_words(whole, text, style, size)
    return png(np.asarray(whole))


def png(picture: Picture) -> bytes:
    """Return a PNG file whose metadata names cembench as its maker."""
    about = PngInfo()
    about.add_text("Software", SOFTWARE)
    buffer = io.BytesIO()
    form = {"compress_level": COMPRESSION, "pnginfo": about}
    Image.fromarray(picture).save(buffer, "PNG", **form)
    return buffer.getvalue()


def _add_overlay(whole: Image.Image, overlay: Overlay, size: tuple[int, int]) -> None:
    """Draw curves and rings over the image, in place."""
    line = max(1.6 * size[0] / DESIGN_WIDTH, 0.8)
    side, corner = panel_side(size), panels_of(size)[1]
    wide = round(line * SAMPLES)

    def drawn(colour: tuple[int, ...], add: Callable[[ImageDraw.ImageDraw], None]) -> None:
        mask = Image.new("L", (side * SAMPLES, side * SAMPLES))
        add(ImageDraw.Draw(mask))
        whole.paste(colour, (*corner, corner[0] + side, corner[1] + side), mask.reduce(SAMPLES))

    def curves(draw: ImageDraw.ImageDraw) -> None:
        for curve in overlay.curves:
            points = _in_panel(np.concatenate([curve, curve[:2]]), side * SAMPLES)
            draw.line(points, fill=255, width=wide, joint="curve")

    def rings(draw: ImageDraw.ImageDraw) -> None:
        reach = RING * line * SAMPLES / 2
        for x, y in _in_panel(overlay.marks, side * SAMPLES):
            box = (x - reach, y - reach, x + reach, y + reach)
            draw.ellipse(box, outline=255, width=wide)

    drawn(ImageColor.getrgb(INK), curves)
    if len(overlay.marks):
        drawn(tuple(round(255 * part) for part in FOLDED), rings)


def _in_panel(points: NDArray[np.float64], side: int) -> list[tuple[float, float]]:
    """Convert window coordinates (k, 2) to pixels of a panel, rows downwards."""
    x, y = (points[:, 0] + 1) / 2 * side, (1 - points[:, 1]) / 2 * side
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _add_words(whole: Image.Image, text: str, style: Style, size: tuple[int, int]) -> None:
    """Centre a text in its place below the panels, as large as it fits."""
    if not text:
        return
    scale = size[0] / DESIGN_WIDTH
    room = size[1] - panel_gap(size) - panel_side(size)
    lines, pixels = _fitted(text, style, style.pixels * scale, size[0] - 2 * panel_gap(size))
    middle = size[1] - style.place * min(room, WORDS * scale)
    draw, font = ImageDraw.Draw(whole), _font(pixels, bold=style.bold)
    for k, line in enumerate(lines):
        y = middle + (k - (len(lines) - 1) / 2) * LINE * pixels
        draw.text((size[0] / 2, y), line, style.colour, font, anchor="mm")


def _fitted(text: str, style: Style, pixels: float, width: float) -> tuple[list[str], float]:
    """Shrink a text a little, else break it into two lines and shrink more, else cut it.

    Returns the lines and their font size in pixels.
    """

    def fits(lines: list[str], least: float) -> float | None:
        """Return the largest size in pixels at which lines fit; None below the share `least`."""
        share = 1.0  # in steps: glyphs are placed on whole pixels, so widths do not scale exactly
        while share >= least:
            font = _font(pixels * share, bold=style.bold)
            if max(font.getlength(line) for line in lines) <= width:
                return pixels * share
            share -= 0.02
        return None

    for count, least in ((1, EASY), (2, SMALLEST)):
        lines = _broken(text, count)
        size = fits(lines, least)
        if size is not None:
            return lines, size
    while len(text) > 1 and fits(_broken(text + " …", 2), SMALLEST) is None:
        text = text[: int(0.9 * len(text))]
    return _broken(text + " …", 2), fits(_broken(text + " …", 2), SMALLEST) or pixels * SMALLEST


@cache
def _font(pixels: float, *, bold: bool) -> ImageFont.FreeTypeFont:
    """Load the font that comes with matplotlib, without importing matplotlib."""
    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.origin is not None
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    fonts = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf"
    plain = ImageFont.Layout.BASIC  # the other layout engine loads a library for complex scripts
    return ImageFont.truetype(str(fonts / name), max(pixels, 4.0), layout_engine=plain)


def _broken(text: str, lines: int) -> list[str]:
    """Break a text into this many lines of similar length; groups parted by spaces stay whole."""
    groups = "   " in text
    text = re.sub(r"(?<! ) (?! )", "\u00a0", text) if groups else text
    length = -(-len(text) // lines)
    while len(parts := textwrap.wrap(text, length, break_long_words=not groups)) > lines:
        length += 1
    return parts or [text]
