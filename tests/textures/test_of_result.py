"""What entry points add to a Result is found as its methods."""

import copy
import io
import pickle

import numpy as np
import pytest
from PIL import Image

import cembench
from tests import gallery


@pytest.fixture(scope="module")
def result():
    return cembench.parameterize(cembench.surface("flat-disk", 200), "harmonic-circle")


def test_functions_of_entry_points_are_methods(result):
    assert {"bake", "geometry_image", "remesh", "save"} <= set(dir(result))
    assert result.geometry_image(9).shape == (9, 9, 3)
    assert result.remesh(9).m > 20
    with pytest.raises(cembench.ParameterError, match="side=3 is not allowed; write an integer"):
        result.remesh(3)


def test_a_name_that_nobody_brings_is_refused(result):
    with pytest.raises(AttributeError, match="a Result has no attribute 'paint'"):
        result.paint()
    again = pickle.loads(pickle.dumps(copy.copy(result)))
    np.testing.assert_array_equal(again.z, result.z)


def test_a_texture_is_baked_for_the_coordinates_that_save_writes(tmp_path):
    V, F = gallery.flat_rectangle()
    uv = (V[:, :2] - V[:, :2].min(axis=0)) / np.ptp(V[:, :2], axis=0)
    lines = [f"v {x} {y} {z}" for x, y, z in V] + [f"vt {u} {v}" for u, v in uv]
    lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in F]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    Image.new("RGB", (32, 32), (200, 10, 30)).save(tmp_path / "paint.png")
    png = cembench.parameterize(tmp_path / "a.obj").bake(tmp_path / "paint.png", tmp_path / "a.obj")
    with Image.open(io.BytesIO(png)) as picture:
        assert picture.size == (32, 32)
        assert picture.getpixel((16, 16)) == (200, 10, 30, 255)
