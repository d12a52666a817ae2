"""A page of equally large pictures in rows, with text and marks."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cembench.drawing.compose import INK

#: What is drawn on a picture, by its row and column: points (k, 2) in window coordinates, -1 to 1,
#: each with its style.
Marks = Mapping[tuple[int, int], Sequence[tuple[NDArray[np.float64], Mapping[str, Any]]]]
DPI = 100


def page(
    rows: Sequence[Sequence[NDArray[np.uint8]]],
    heads: Sequence[str],
    *,
    sides: Sequence[str] = (),
    notes: Sequence[Sequence[str]] = (),
    marks: Marks = MappingProxyType({}),
) -> bytes:
    """Return a PNG of pictures, with text above columns or the page, beside rows, and below."""
    side = len(rows[0][0])
    top, left, below = 46, 24 if sides else 6, 24 if notes else 4
    across = side * len(rows[0])
    width, height = left + across + 6, top + (side + below) * len(rows) + 4
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)

    def write(x: float, y: float, text: str, **style: Any) -> None:
        style |= {"color": INK, "ha": "center", "va": "center", "parse_math": False}
        figure.text(x / width, y / height, text, **style)

    for k, head in enumerate(heads):
        x = left + (k + 0.5) * across / len(heads)
        write(x, height - top / 2, head, fontsize=10, weight="bold")
    for r, pictures in enumerate(rows):
        bottom = height - top - r * (side + below) - side
        if sides:
            write(left / 2, bottom + side / 2, sides[r], rotation=90, fontsize=10)
        for k, picture in enumerate(pictures):
            x = left + k * side
            axes = figure.add_axes((x / width, bottom / height, side / width, side / height))
            axes.imshow(picture, extent=(-1, 1, -1, 1), interpolation="nearest")
            axes.set_axis_off()
            for points, style in marks.get((r, k), ()):
                axes.plot(*points.T, **style)
            if notes:
                write(x + side / 2, bottom - below / 2, notes[r][k], fontsize=9)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()
