"""Puts the two panels of a preview on a page, with the boundary's image and the words."""

from __future__ import annotations

import io
import textwrap
import warnings
from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import NDArray

from cembench.drawing.own_pictures import SOFTWARE
from cembench.drawing.scene import FOLDED

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Style:
    """Place from the bottom up, in parts of the words' room; size in pixels; colour; weight."""

    place: float
    pixels: int
    colour: str
    weight: str = "normal"


DPI = 100
#: Pixels between and around the panels, and for the words below them, at the size 1600 x 940.
GAP, WORDS, DESIGN_WIDTH = 40, 160, 1600
#: The lines of words, placed by their middles.
TITLE = Style(0.72, 30, "#1a2733", "bold")
CAPTION = Style(0.42, 23, "#33475a")
NOTE = Style(0.13, 17, "#7a8894")
INK = "#22384d"
#: Diameter of a ring round a fold, in widths of its line.
RING = 7.0
#: Words are shrunk to the first share of their size, then broken into two lines and shrunk to the
#: second, before they are cut.
EASY, SMALLEST = 0.85, 0.6


def gap_of(size: tuple[int, int]) -> int:
    """How many pixels of white are there round the panels?"""
    return round(GAP * size[0] / DESIGN_WIDTH)


def side_of(size: tuple[int, int]) -> int:
    """How many pixels has the side of a panel on a page of this width and height?"""
    gap, words = gap_of(size), round(WORDS * size[0] / DESIGN_WIDTH)
    return min((size[0] - 3 * gap) // 2, size[1] - gap - words)


def panels_of(size: tuple[int, int]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Column and row of the upper left pixel of the surface's and of the image's panel."""
    gap, side = gap_of(size), side_of(size)
    left = (size[0] - 2 * side - gap) // 2
    return (left, gap), (left + side + gap, gap)


@dataclass(frozen=True)
class Overlay:
    """What lies on the image; points float64 (k, 2) in window coordinates, -1 to 1.

    Parameters
    ----------
    curves : tuple of array
        Closed curves, the first point not repeated.
    marks : array
        Places to be ringed in red.

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
    """Which PNG shows these two pictures?

    Parameters
    ----------
    surface, image : uint8 (side, side, 3)
        As large as :func:`side_of` says.
    overlay : Overlay
        What lies on the image.
    words : tuple of str
        Title, caption and a note, each possibly empty.
    size : tuple of int
        Width and height of the page in pixels.

    """
    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    for picture, (column, row) in zip((surface, image), panels_of(size), strict=True):
        figure.figimage(picture, column, size[1] - row - len(picture), origin="upper")
    _add_overlay(figure, overlay, size)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # a box is drawn instead
        for text, style in zip(words, (TITLE, CAPTION, NOTE), strict=True):
            _add_words(figure, text, style, size)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": SOFTWARE})
    return buffer.getvalue()


def _add_overlay(figure: Figure, overlay: Overlay, size: tuple[int, int]) -> None:
    line: float = max(1.6 * size[0] / DESIGN_WIDTH, 0.8) * 72 / DPI
    for curve in overlay.curves:
        x, y = _on_page(np.concatenate([curve, curve[:1]]), size)
        figure.add_artist(Line2D(x, y, color=INK, linewidth=line))
    x, y = _on_page(overlay.marks, size)
    rings = Line2D(x, y, linestyle="", marker="o", markersize=RING * line)
    rings.set(markerfacecolor="none", markeredgecolor=FOLDED, markeredgewidth=line)
    figure.add_artist(rings)


def _on_page(points: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    """Window coordinates (k, 2) of the image in parts of the page, (2, k)."""
    side, (column, row) = side_of(size), panels_of(size)[1]
    x = column + (points[:, 0] + 1) / 2 * side
    y = size[1] - row - (1 - points[:, 1]) / 2 * side
    return np.stack([x / size[0], y / size[1]])


def _add_words(figure: Figure, text: str, style: Style, size: tuple[int, int]) -> None:
    """Centre the text in its place below the panels, as large as fits."""
    if not text:
        return
    place, pixels, colour = style.place, style.pixels, style.colour
    scale = size[0] / DESIGN_WIDTH
    room = size[1] - gap_of(size) - side_of(size)
    words = figure.text(
        0.5,
        place * min(room, WORDS * scale) / size[1],
        text,
        fontsize=pixels * scale * 72 / DPI,
        color=colour,
        ha="center",
        va="center",
        parse_math=False,
        fontfamily="DejaVu Sans",
        fontweight=style.weight,
        linespacing=1.15,
    )
    _fit(words, size[0] - 2 * gap_of(size))


def _fit(words: Text, width: float) -> None:
    """Shrink a little, else break into two lines and shrink more, else cut: nothing runs out."""
    text, size = words.get_text(), float(words.get_fontsize())
    for lines, least in ((1, EASY), (2, SMALLEST)):
        words.set_text(_broken(text, lines))
        share = width / _width(words)
        if share >= least:
            words.set_fontsize(size * min(1.0, share))
            return
    words.set_fontsize(size * SMALLEST)
    while len(text) > 1 and _width(words) > width:
        text = text[: int(0.95 * len(text))]
        words.set_text(_broken(text + " …", 2))


def _width(words: Text) -> float:
    return float(words.get_window_extent().width)


def _broken(text: str, lines: int) -> str:
    """Break into this many lines of about the same length."""
    length = -(-len(text) // lines)
    while len(parts := textwrap.wrap(text, length)) > lines:
        length += 1
    return "\n".join(parts)
