"""The checkerboard texture of the files that are written."""

from __future__ import annotations

import io
from functools import cache

import numpy as np
from PIL import Image

from cembench.drawing.scene import DARK, LIGHT

#: Side of the checkerboard in pixels, and its number of squares along a side.
SIDE, SQUARES = 1024, 32


@cache
def checker_png() -> bytes:
    """Return a checkerboard in the colours of our pictures as a PNG file."""
    squares = np.indices((SQUARES, SQUARES)).sum(axis=0) % 2
    board = np.kron(squares, np.ones((SIDE // SQUARES,) * 2)).astype(np.uint8)
    picture = Image.fromarray(board, "P")
    picture.putpalette((255 * np.array([LIGHT, DARK])).round().astype(np.uint8).tobytes())
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
