import io

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from PIL import Image

from cembench import DiskMesh
from cembench.drawing import scene as look
from cembench.drawing import shading


@pytest.fixture(scope="module")
def disk():
    mesh = flat_disk(300)
    return mesh, mesh.V[:, 0] + 1j * mesh.V[:, 1]


def near(picture, colour, by=30):
    return np.abs(picture.astype(int) - 255 * np.array(colour)).max(axis=2) < by


def test_a_flat_disk_and_itself_look_alike(disk):
    mesh, uv = disk
    surface, image = shading.surface_panel(mesh, 64), shading.image_panel(mesh, uv, 64)
    colours = [shading.checkerboard(p, mesh, uv, surface) for p in (surface, image)]
    np.testing.assert_allclose(colours[0], colours[1])
    shares = np.unique(colours[0], axis=0)
    assert len(shares) == 2


def test_the_edges_of_a_mesh_are_drawn_where_they_are():
    mesh = DiskMesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 3], [0, 3, 2]]
    )
    picture = shading.paint(panel := shading.surface_panel(mesh, 80), shading.edges(panel))
    brightness = picture.mean(axis=2)
    diagonal = brightness[np.arange(79, -1, -1), np.arange(80)]  # from below left
    assert diagonal[10:70].max() < brightness[60, 60] - 40


def test_folds_are_red(disk):
    mesh, uv = disk
    centre = int(np.argmin(np.abs(uv)))
    folded = uv.copy()
    folded[centre] = 1.5
    panel = shading.image_panel(mesh, folded, 64)
    picture = shading.paint(panel, shading.checkerboard(panel, mesh, folded, panel))
    assert panel.folded.any()
    hue = picture.astype(int)
    assert ((hue[:, :, 0] > hue[:, :, 1] + 60) & (hue[:, :, 0] > hue[:, :, 2] + 60)).any()
    calm = shading.image_panel(mesh, uv, 64)
    assert not calm.folded.any()


def test_curvature_is_orange_outwards_and_blue_inwards(disk):
    mesh, _ = disk
    panel = shading.surface_panel(mesh, 32)
    one_sided = np.where(mesh.V[:, 0] > 0, 1.0, -1.0)
    colours = shading.curvature(panel, one_sided)
    x = panel.at(mesh.V[:, 0])
    np.testing.assert_allclose(colours[x > 0.5], np.tile(shading.OUTWARDS, ((x > 0.5).sum(), 1)))
    np.testing.assert_allclose(colours[x < -0.5], np.tile(shading.INWARDS, ((x < -0.5).sum(), 1)))
    np.testing.assert_allclose(shading.curvature(panel, 0 * one_sided), [look_even()] * len(x))


def look_even():
    return shading.EVEN


def test_a_picture_file_is_small_and_the_same_again(disk):
    mesh, uv = disk
    panel = shading.image_panel(mesh, uv, 100)
    picture = shading.paint(panel, shading.checkerboard(panel, mesh, uv, panel))
    both = shading.beside([picture, picture])
    assert both.shape == (100, 200 + shading.GAP, 3)
    content = shading.jpeg(both)
    assert content == shading.jpeg(both)
    assert Image.open(io.BytesIO(content)).size == (200 + shading.GAP, 100)
    assert near(picture, look.LIGHT, 60).any()
