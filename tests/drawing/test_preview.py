from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from PIL import Image

from cembench.core.errors import ParameterError, RenderError
from cembench.drawing import compose, painter
from cembench.drawing.preview import draw_panels, write_preview
from cembench.drawing.scene import FILL, SQUARES
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import load_registry

SMALL = (640, 376)


@lru_cache
def flat_disk() -> DiskMesh:
    mesh = load_registry().surface("flat-disk").function(1_500)
    assert isinstance(mesh, DiskMesh)
    return mesh


def seen_from_above(mesh):
    return mesh.V[:, 0] + 1j * mesh.V[:, 1]


def folded_map(mesh):
    """The identity, except that a vertex in the middle is pulled over its neighbours."""
    uv = seen_from_above(mesh)
    uv[np.argmin(np.abs(uv))] += 0.3
    return uv


def pixels(path):
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB")).astype(int)


def panels(path, size):
    picture, side = pixels(path), compose.panel_side(size)
    return [picture[row : row + side, col : col + side] for col, row in compose.panels_of(size)]


def reddish(picture):
    return (picture[..., 0] > 1.8 * picture[..., 1]) & (picture[..., 0] > 80)


def test_png_has_the_asked_size_and_panels_with_something_in_them(tmp_path):
    mesh = flat_disk()
    path = tmp_path / "disk.png"
    write_preview(mesh, seen_from_above(mesh), path, title="A disk", size=SMALL)
    assert pixels(path).shape == (SMALL[1], SMALL[0], 3)
    for panel in panels(path, SMALL):
        assert 0.70 < (panel < 250).any(axis=2).mean() < 0.80  # pi / 4 of the square
    assert [file.name for file in tmp_path.iterdir()] == ["disk.png"]


def test_squares_of_a_flat_disk_are_where_they_must_be():
    mesh = flat_disk()
    side = 360
    centres = np.arange(-SQUARES // 2, SQUARES // 2) + 0.5
    x, y = (c.ravel() for c in np.meshgrid(centres, centres))
    inside = np.hypot(x, y) < SQUARES / 2 - 1
    x, y = x[inside], y[inside]
    dark = (np.floor(x) + np.floor(y)) % 2 == 1
    column = ((x * 2 * FILL / SQUARES + 1) / 2 * side).astype(int)
    row = ((1 - y * 2 * FILL / SQUARES) / 2 * side).astype(int)
    for picture in draw_panels(mesh, seen_from_above(mesh), side):
        blueness = picture[row, column, 2].astype(int) - picture[row, column, 0]
        np.testing.assert_array_equal(blueness > 40, dark)


def test_square_edges_are_exact_to_a_pixel_on_a_coarse_mesh():
    """Colour is decided at pixels, not at triangles: a single square needs only two."""
    V = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    mesh = DiskMesh.from_arrays(V, [[0, 1, 2], [0, 2, 3]])
    side = 400
    for picture in draw_panels(mesh, seen_from_above(mesh), side):
        blue = picture[:, :, 2].astype(int) - picture[:, :, 0] > 20
        row = blue[int(side * (0.5 + FILL / 2 - 0.5 * FILL / SQUARES))]
        changes = np.flatnonzero(np.diff(row.astype(int))) + 1
        step = side * FILL / SQUARES
        expected = side * (1 - FILL) / 2 + step * np.arange(1, SQUARES)
        missing = np.abs(expected[:, None] - changes[None, :]).min(axis=1).max()
        assert missing < 1


def test_folds_are_red_in_both_panels():
    mesh = flat_disk()
    for picture in draw_panels(mesh, folded_map(mesh), 300):
        assert reddish(picture.astype(int)).sum() > 20
    for picture in draw_panels(mesh, seen_from_above(mesh), 300):
        assert not reddish(picture.astype(int)).any()


def test_a_fold_too_small_to_be_seen_is_ringed(tmp_path):
    mesh = flat_disk()
    uv = seen_from_above(mesh)
    a, b, c = mesh.F[len(mesh.F) // 2]
    uv[[b, c]] = uv[a]  # some triangles collapse
    path = tmp_path / "collapsed.png"
    write_preview(mesh, uv, path, size=SMALL)
    assert reddish(panels(path, SMALL)[1]).sum() > 5


def test_holes_and_images_that_are_no_disk(tmp_path):
    r, t = np.meshgrid([0.4, 0.7, 1.0], np.arange(24) * np.pi / 12)
    V = np.stack([3 * r * np.cos(t), r * np.sin(t), 0 * r], axis=2).reshape(-1, 3)
    quads = [(3 * k + j, 3 * k + j + 1) for k in range(24) for j in range(2)]
    F = [f for a, b in quads for f in ((a, b, (b + 3) % 72), (a, (b + 3) % 72, (a + 3) % 72))]
    mesh = HoledMesh.from_arrays(V, F)
    path = tmp_path / "ring.png"
    write_preview(mesh, 5 * seen_from_above(mesh) + 100, path, size=SMALL)
    for panel in panels(path, SMALL):
        middle = len(panel) // 2
        assert (panel[middle, middle] == 255).all()
        assert (panel[middle, 20] < 255).any()
        assert (panel[20] == 255).all()


def test_long_words_stay_on_the_page(tmp_path):
    mesh = flat_disk()
    path = tmp_path / "words.png"
    write_preview(
        mesh,
        seen_from_above(mesh),
        path,
        title="a very long name of a surface $x_1 " * 20,
        caption="E_C = 1.234 · mean angle error 0.12° · " * 20,
        size=SMALL,
    )
    picture = pixels(path)
    assert (picture[:, :8] == 255).all()
    assert (picture[:, -8:] == 255).all()
    assert (picture[-2:] == 255).all()
    assert (picture[compose.panel_gap(SMALL) + compose.panel_side(SMALL) :] < 200).any()


def test_a_figure_is_not_parted_from_its_name():
    one, other = compose._broken("angle error 1.64 degrees   folded triangles 0", 2)
    assert one.split() == ["angle", "error", "1.64", "degrees"]
    assert other.split() == ["folded", "triangles", "0"]
    assert compose._broken("a long title of four", 2) == ["a long title", "of four"]


def test_a_picture_that_cannot_be_drawn_is_an_error(tmp_path, monkeypatch):
    def fail(mesh, uv, side):
        raise MemoryError("no room")

    monkeypatch.setattr(painter, "under_checkerboard", fail)
    mesh = flat_disk()
    with pytest.raises(RenderError, match="could not be drawn: MemoryError: no room"):
        write_preview(mesh, seen_from_above(mesh), tmp_path / "disk.png", size=SMALL)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("place", ["missing/disk.png", "a-file/disk.png", "a-folder"])
def test_error_when_the_file_cannot_be_written(tmp_path, place):
    (tmp_path / "a-file").write_text("")
    (tmp_path / "a-folder").mkdir()
    before = sorted(tmp_path.rglob("*"))
    mesh = flat_disk()
    with pytest.raises(RenderError, match=r"cannot be written: .*Choose another path"):
        write_preview(mesh, seen_from_above(mesh), tmp_path / place, size=SMALL)
    assert sorted(tmp_path.rglob("*")) == before


def test_an_older_picture_survives_a_full_disk(tmp_path, monkeypatch):
    path = tmp_path / "disk.png"
    path.write_bytes(b"older")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    mesh = flat_disk()
    with pytest.raises(RenderError, match="No space left on device"):
        write_preview(mesh, seen_from_above(mesh), path, size=SMALL)
    assert [file.name for file in tmp_path.iterdir()] == ["disk.png"]
    assert path.read_bytes() == b"older"


def test_maps_and_sizes_that_cannot_be_drawn_are_refused(tmp_path):
    mesh = flat_disk()
    uv = seen_from_above(mesh)
    with pytest.raises(ParameterError, match=rf"shape \(3,\); allowed is \({mesh.n},\)"):
        write_preview(mesh, uv[:3], tmp_path / "disk.png")
    uv[7] = np.nan
    with pytest.raises(ParameterError, match=r"at 1 of .* the first being 7"):
        write_preview(mesh, uv, tmp_path / "disk.png")
    with pytest.raises(ParameterError, match="size 100 x 100"):
        write_preview(mesh, seen_from_above(mesh), tmp_path / "disk.png", size=(100, 100))


def test_the_image_is_turned_upright(tmp_path):
    """A map that is turned gives the same picture: maps are compared by eye."""
    mesh = flat_disk()
    pictures = []
    for turn in (1, 1j, np.exp(2.5j)):
        write_preview(mesh, turn * seen_from_above(mesh), tmp_path / "disk.png", size=SMALL)
        pictures.append(panels(tmp_path / "disk.png", SMALL)[1])
    assert np.abs(pictures[1] - pictures[0]).mean() < 1
    assert np.abs(pictures[2] - pictures[0]).mean() < 1
