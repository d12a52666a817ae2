import numpy as np
import pytest
from cembench.textures.bake import uv_of_faces

from cembench import MeshError

POINTS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
TEXTURE = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5\n"


def read(folder, text, F):
    (folder / "a.obj").write_text(text)
    return uv_of_faces(folder / "a.obj", np.array(F))


def test_polygons_relative_indices_and_seams(tmp_path):
    text = POINTS + TEXTURE + "f 1/1 2/2/9 3/3 4/4\nf -4/-5 -2/-3 -3/5\n"
    surface = read(tmp_path, text, [[0, 1, 2], [0, 2, 3], [2, 1, 0]])
    np.testing.assert_array_equal(
        surface, [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]], [[1, 1], [0.5, 0], [0, 0]]]
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (POINTS + "f 1 2 3\n", r"1 of 1 triangles have no texture coordinates"),
        (POINTS + TEXTURE + "f 1/9 2/1 3/1\n", r"1 of 1 triangles have no texture coordinates"),
        (POINTS + TEXTURE + "f 1/1 2/2 3/3 4/4\n", "its faces are not those of the surface"),
        (POINTS + TEXTURE + "f 1/1 2/2 4/4\n", "its faces are not those of the surface"),
        (POINTS + "vt a b\nf 1/1 2/1 3/1\n", "line 5, 'vt a b': this is not a texture coordinate"),
        (POINTS + "vt nan 0\nf 1/1 2/1 3/1\n", "texture coordinate 1 .* is not finite"),
    ],
)
def test_what_has_no_texture_coordinates_is_refused(text, message, tmp_path):
    with pytest.raises(MeshError, match=message):
        read(tmp_path, text, [[0, 1, 2]])


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(MeshError, match="from OBJ files only"):
        uv_of_faces(tmp_path / "a.ply", np.array([[0, 1, 2]]))
