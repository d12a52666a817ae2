import io

import numpy as np
from PIL import Image

from cembench.drawing.texture import SIDE, checker_png

#: A square of two triangles, corners in turn.
SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=float)


def test_the_checkerboard_is_small_and_has_two_colours():
    picture = Image.open(io.BytesIO(checker_png()))
    assert picture.size == (SIDE, SIDE)
    assert len(picture.convert("RGB").getcolors()) == 2
    assert len(checker_png()) < 3_000
