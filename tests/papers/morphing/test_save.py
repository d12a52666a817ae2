import numpy as np
import pytest
from cembench.papers.cem.morphing.morph import morph

from cembench import ParameterError
from tests.papers.morphing.reliefs import three


@pytest.fixture(scope="module")
def found():
    return morph(*three())


def test_a_path_is_saved_as_arrays_meshes_and_a_film(found, tmp_path):
    assert found.save(tmp_path / "a.npz", frames=3) == [tmp_path / "a.npz"]
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_array_equal(arrays["frames"][1], found.at(0.5))
    files = found.save(tmp_path / "a.ply", frames=3)
    assert [file.name for file in files] == ["a_000.ply", "a_001.ply", "a_002.ply"]
    assert all(file.is_file() for file in files)
    (film,) = found.save(str(tmp_path / "a.gif"), frames=2, views=["front"], size=64)
    assert film.read_bytes()[:3] == b"GIF"


def test_another_format_is_refused(found, tmp_path):
    with pytest.raises(ParameterError, match=r"'.avi' is unknown; allowed: .gif or .mp4"):
        found.save(tmp_path / "a.avi")
