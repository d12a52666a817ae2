import io

import numpy as np
import pytest
from cembench.textures.bake import baked_png, read_texture
from PIL import Image

from cembench import RenderError

#: A square of two triangles, corners in turn.
SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=float)


def slope(side):
    """A picture whose red goes with u and whose green goes with v, which points up."""
    u = (np.arange(side) + 0.5) / side
    pixels = np.zeros((side, side, 4))
    pixels[..., 0], pixels[..., 1], pixels[..., 3] = 255 * u, 255 * u[::-1, None], 255
    return Image.fromarray(pixels.round().astype(np.uint8), "RGBA")


def painted(texture, old, new):
    return np.asarray(Image.open(io.BytesIO(baked_png(texture, old, new)))).astype(float)


def test_the_same_coordinates_give_the_same_texture():
    np.testing.assert_array_equal(painted(slope(64), SQUARE, SQUARE), np.asarray(slope(64)))


def test_a_quarter_turn_turns_the_texture():
    turned = np.stack([1 - SQUARE[..., 1], SQUARE[..., 0]], axis=2)
    picture = painted(slope(64), SQUARE, turned)
    np.testing.assert_array_equal(picture, np.rot90(np.asarray(slope(64))))


def test_a_smaller_map_repeats_its_rim_outside():
    picture = painted(slope(64), SQUARE, 0.25 + SQUARE / 2)
    np.testing.assert_allclose(picture[32, 16:48, 0], 255 * (np.arange(32) + 0.5) / 32, atol=2.5)
    assert (picture[32, :16] == picture[32, 16]).all()


def test_coordinates_outside_the_square_repeat_the_texture():
    shifted = painted(slope(64), SQUARE + np.array([2, -1]), SQUARE)
    np.testing.assert_array_equal(shifted, np.asarray(slope(64)))


@pytest.mark.parametrize("content", [None, b"no picture"])
def test_what_is_no_texture_is_refused(content, tmp_path):
    if content:
        (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(RenderError, match=r"a\.png cannot be read: .*Name a PNG or JPEG"):
        read_texture(tmp_path / "a.png")
