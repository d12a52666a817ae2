import io

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from PIL import Image

from cembench import DiskMesh
from cembench.drawing import painter
from cembench.drawing import scene as look
from cembench.drawing.scene import Board, folded_by, surface_in_window


@pytest.fixture(scope="module")
def disk():
    mesh = flat_disk(300)
    return mesh, mesh.V[:, 0] + 1j * mesh.V[:, 1]


def panels(mesh, uv, side):
    """Return the surface, the image and the checkerboard."""
    space = surface_in_window(mesh)
    image = painter.image_panel(mesh.F, space, uv, folded_by(uv, mesh.F), side)
    return painter.surface_panel(mesh.F, space, side), image, Board.of(mesh.F, space, uv)


def near(picture, colour, by=30):
    return np.abs(picture.astype(int) - 255 * np.array(colour)).max(axis=2) < by


def test_a_flat_disk_and_itself_look_alike(disk):
    mesh, uv = disk
    surface, image, board = panels(mesh, uv, 64)
    colours = [painter.checkerboard(p, board)(p.raster) for p in (surface, image)]
    np.testing.assert_allclose(colours[0], colours[1])
    shares = np.unique(colours[0], axis=0)
    assert len(shares) == 2


def test_the_edges_of_a_mesh_are_drawn_where_they_are():
    mesh = DiskMesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 3], [0, 3, 2]]
    )
    panel = painter.surface_panel(mesh.F, surface_in_window(mesh), 80)
    picture = painter.paint(panel, painter.edges(panel))
    brightness = picture.mean(axis=2)
    diagonal = brightness[np.arange(79, -1, -1), np.arange(80)]  # from below left
    assert diagonal[10:70].max() < brightness[60, 60] - 40


def test_folds_are_red(disk):
    mesh, uv = disk
    centre = int(np.argmin(np.abs(uv)))
    folded = uv.copy()
    folded[centre] = 1.5
    _, panel, board = panels(mesh, folded, 64)
    red = folded_by(folded, mesh.F)
    picture = painter.paint(panel, painter.checkerboard(panel, board), red)
    assert red.any()
    hue = picture.astype(int)
    assert ((hue[:, :, 0] > hue[:, :, 1] + 60) & (hue[:, :, 0] > hue[:, :, 2] + 60)).any()
    assert not folded_by(uv, mesh.F).any()


def test_curvature_is_orange_outwards_and_blue_inwards(disk):
    mesh, _ = disk
    panel = painter.surface_panel(mesh.F, surface_in_window(mesh), 32)
    one_sided = np.where(mesh.V[:, 0] > 0, 1.0, -1.0)
    colours = painter.curvature(panel, one_sided)(panel.raster)
    x = panel.raster.interpolate(mesh.V[:, 0][mesh.F].ravel())
    np.testing.assert_allclose(colours[x > 0.5], np.tile(painter.OUTWARDS, ((x > 0.5).sum(), 1)))
    np.testing.assert_allclose(colours[x < -0.5], np.tile(painter.INWARDS, ((x < -0.5).sum(), 1)))
    even = painter.curvature(panel, 0 * one_sided)(panel.raster)
    np.testing.assert_allclose(even, [painter.EVEN] * len(x))


def test_a_picture_file_is_small_and_the_same_again(disk):
    mesh, uv = disk
    _, panel, board = panels(mesh, uv, 100)
    picture = painter.paint(panel, painter.checkerboard(panel, board))
    both = painter.beside([picture, picture])
    assert both.shape == (100, 200 + painter.GAP, 3)
    content = painter.jpeg(both)
    assert content == painter.jpeg(both)
    assert Image.open(io.BytesIO(content)).size == (200 + painter.GAP, 100)
    assert near(picture, look.LIGHT, 60).any()
