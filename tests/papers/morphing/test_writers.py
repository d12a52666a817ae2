import sys
from pathlib import Path

import numpy as np
import pytest
from cembench.papers.cem.morphing.writers import (
    check_output,
    mesh_files,
    write_arrays,
    write_film,
    write_meshes,
)
from cembench.surfaces.flat_disk import flat_disk
from PIL import Image

from cembench.core.errors import CembenchError, RecordError
from cembench.mesh.files import read_mesh
from tests.limits import files_of_at_most, tree

MESH = flat_disk(100)
TIMES = np.linspace(0, 1, 4)


def at(time):
    return (1 + time) * MESH.V


@pytest.fixture
def pictures():
    return np.random.default_rng(0).integers(0, 256, (30, 33, 66, 3), dtype=np.uint8) // 64 * 64


def test_a_gif_has_all_frames_at_24_a_second(pictures, tmp_path):
    write_film(tmp_path / "a.gif", pictures)
    with Image.open(tmp_path / "a.gif") as film:
        durations = []
        for k in range(film.n_frames):
            film.seek(k)
            durations.append(film.info["duration"])
    assert len(durations) == 30
    assert sum(durations) == pytest.approx(30 * 1000 / 24, abs=5)
    assert set(durations) <= {40, 50}


def test_an_mp4_has_all_frames_at_24_a_second(pictures, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    write_film(tmp_path / "a.mp4", pictures)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))
    assert count == 30
    assert seconds == pytest.approx(30 / 24, abs=0.05)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize("name", ["a.gif", "a.mp4"])
def test_a_film_that_cannot_be_written_is_an_error(name, pictures, tmp_path):
    (tmp_path / name).mkdir()
    with pytest.raises(RecordError, match="cannot be written"):
        write_film(tmp_path / name, pictures)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.gif", "a.mp4"])
def test_a_film_on_a_full_disk_leaves_the_older_one(name, pictures, tmp_path):
    write_film(tmp_path / name, pictures)
    before = tree(tmp_path)
    with (
        files_of_at_most(len(before[Path(name)]) // 2),
        pytest.raises(RecordError, match="cannot be written"),
    ):
        write_film(tmp_path / name, pictures)
    assert tree(tmp_path) == before


def test_meshes_are_numbered(tmp_path):
    heard = []
    files = write_meshes(tmp_path / "a.obj", MESH, TIMES, at, heard.append)
    assert [file.name for file in files] == ["a_000.obj", "a_001.obj", "a_002.obj", "a_003.obj"]
    assert heard == [0, 1, 2, 3]
    np.testing.assert_allclose(read_mesh(files[3]).V, 2 * MESH.V, rtol=1e-15)


def test_a_folder_is_filled_with_ply(tmp_path):
    files = write_meshes(tmp_path / "new", MESH, TIMES, at)
    assert files[1] == tmp_path / "new" / "frame_001.ply"
    np.testing.assert_allclose(read_mesh(files[1]).V, at(TIMES[1]), rtol=1e-15)


def test_a_folder_may_have_a_dot_in_its_name(tmp_path):
    (tmp_path / "take.2").mkdir()
    check_output(tmp_path / "take.2")
    (first, *_) = write_meshes(tmp_path / "take.2", MESH, TIMES, at)
    assert first == tmp_path / "take.2" / "frame_000.ply"


def test_no_half_of_a_sequence_is_left(tmp_path):
    def breaks(time):
        if time > 0.5:
            raise OSError(28, "No space left on device")
        return at(time)

    with pytest.raises(RecordError, match="No space left on device"):
        write_meshes(tmp_path / "a.obj", MESH, TIMES, breaks)
    assert not list(tmp_path.iterdir())


def test_many_frames_get_more_digits(tmp_path):
    names = mesh_files(tmp_path, 1001)
    assert names[0].name == "frame_0000.ply"
    assert names[-1].name == "frame_1000.ply"


def test_arrays_hold_every_frame(tmp_path):
    write_arrays(tmp_path / "a.npz", MESH, TIMES, at)
    with np.load(tmp_path / "a.npz") as found:
        assert found["frames"].shape == (4, MESH.n, 3)
        np.testing.assert_array_equal(found["frames"][2], at(TIMES[2]))
        np.testing.assert_array_equal(found["F"], MESH.F)


def test_places_that_cannot_be_are_refused_before_work(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    for path, message in (
        (tmp_path / "a.avi", "'.avi' is unknown; allowed: .gif or .mp4"),
        (tmp_path / "no" / "a.gif", "there is no folder"),
        (tmp_path / "file", "is a file, not a folder"),
        (tmp_path / "a.mp4", r"pip install 'cembench\[video\]'"),
    ):
        with pytest.raises(CembenchError, match=message):
            check_output(path)
