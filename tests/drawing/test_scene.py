from __future__ import annotations

import numpy as np
import pytest
from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.levers import NO_LEVERS

from cembench.drawing import scene as look
from cembench.drawing.camera import view_rotation
from cembench.drawing.checkerboard import Checkerboard
from cembench.drawing.rasterizer import rasterize
from cembench.drawing.scene import Board, doubled_areas, surface_in_window
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from tests.real_meshes import real_mesh


def relief(height, faces=800):
    mesh = load_registry().surface("flat-disk").function(faces)
    V = mesh.V.copy()
    V[:, 2] = height(V[:, 0], V[:, 1])
    return DiskMesh.from_arrays(V, mesh.F)


@pytest.mark.parametrize("faces", [100, 3_000])
def test_view_is_a_rotation(faces):
    surfaces = load_registry().surfaces.values()
    check_rotations([s for s in surfaces if s.kept is None and s.name != "ict-face"], faces)


@pytest.mark.slow  # each is sculpted, which takes ten seconds
def test_view_of_a_sculpted_surface_is_a_rotation():
    check_rotations([s for s in load_registry().surfaces.values() if s.kept is not None], 100)


def smallest(surface):
    """The least number of triangles that a surface can be asked for."""
    faces = next(p for p in surface.parameters if p.name == "faces")
    return next(one.ge for one in faces.annotation.__metadata__[0].metadata if hasattr(one, "ge"))


def check_rotations(surfaces, faces):
    assert len(surfaces) > 5
    for surface in surfaces:
        R = view_rotation(surface.function(max(faces, smallest(surface))))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0


def test_flat_surface_is_seen_straight_on():
    mesh = relief(lambda x, y: 0.3 * x)
    np.testing.assert_allclose(view_rotation(mesh)[2], [-0.3, 0, 1] / np.sqrt(1.09), atol=1e-12)


def test_relief_is_seen_obliquely_from_its_front():
    toward = view_rotation(relief(lambda x, y: 0.3 * np.sin(3 * x) * np.cos(3 * y)))[2]
    assert toward[2] > 0.5
    assert toward[1] < -0.3


@pytest.mark.parametrize("name", ["nefertiti", "david-head", "bourbon-bottle"])
def test_what_is_cut_along_z_is_seen_upright_as_if_y_were_up(name):
    mesh = stand_in(f"{name}-stand-in", 2_000, levers=NO_LEVERS)
    right, up, toward = view_rotation(mesh)
    assert up[2] > 0.9
    assert toward[1] < -0.9  # a bust's face looks along -y
    to_y_up = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    turned = DiskMesh.from_arrays(mesh.V @ to_y_up.T, mesh.F)
    np.testing.assert_allclose(view_rotation(turned) @ to_y_up, [right, up, toward], atol=1e-12)


@pytest.mark.parametrize("name", ["demosthenes.off", "max_planck_head.ply", "chinese_lion.obj"])
def test_real_heads_stand_upright_and_look_at_the_viewer(name):
    _, up, toward = view_rotation(read_mesh(real_mesh(name)))
    assert up[1] > 0.9
    assert toward[2] > 0.9


def test_a_finer_board_covers_the_same_surface_with_smaller_squares():
    mesh = relief(lambda x, y: 0 * x)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    uv = (z - 0.7) / (1 - 0.7 * z)  # a Moebius map of the disk: the scale varies by a factor of 32
    space = surface_in_window(mesh)
    board = Board.of(mesh.F, space, uv)
    assert board.squares.depth
    corners = board.places[mesh.F]
    _, level = board.squares.at(corners.mean(axis=1))
    sides = np.sqrt(doubled_areas(space[mesh.F]) / doubled_areas(corners))
    assert np.nanquantile(sides / look.FINER**level, 0.99) < 1.7 * look.LARGEST_SQUARE
    assert level.max() == 1


def test_squares_are_divided_whole_or_not_at_all():
    rng = np.random.default_rng(3)
    places = rng.uniform(-4.5, 4.5, (40_000, 2))
    fineness = 3 - 1.2 * np.hypot(*places.T)  # finest in the middle
    board = Checkerboard.of(places, fineness, np.ones(len(places)))
    dark, level = board.at(places)
    assert set(level) == {0, 1, 2, 3}
    for depth in range(4):
        square = np.floor(places * 3.0**depth).astype(int)
        _, which = np.unique(square, axis=0, return_inverse=True)
        deepest = np.full(which.max() + 1, 0)
        least = np.full(which.max() + 1, 9)
        np.maximum.at(deepest, which, level > depth)
        np.minimum.at(least, which, level > depth)
        np.testing.assert_array_equal(deepest, least)  # all of it is finer, or nothing
    np.testing.assert_array_equal(
        dark, np.floor(places * 3.0 ** level[:, None]).sum(axis=1) % 2 == 1
    )


def test_rasterizer_covers_a_square_without_cracks_and_interpolates_exactly():
    rng = np.random.default_rng(1)
    mesh = load_registry().surface("flat-disk").function(5_000)
    corners = np.column_stack([mesh.V[:, :2], rng.random(mesh.n)])[mesh.F].reshape(-1, 3)
    raster = rasterize(corners, 200)
    assert abs(len(raster.pixel) / 200**2 - np.pi / 4) < 0.01
    row, column = np.divmod(raster.pixel, 200)
    seen = raster.interpolate(corners[:, :2])
    np.testing.assert_allclose(seen[:, 0], (column + 0.5) / 100 - 1, atol=1e-9)
    np.testing.assert_allclose(seen[:, 1], 1 - (row + 0.5) / 100, atol=1e-9)


def test_rasterizer_shows_the_nearest_triangle(monkeypatch):
    monkeypatch.setattr("cembench.drawing.rasterizer.CHUNK", 500)  # several portions
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1, 1, (60, 3, 3))
    corners[:, :, 2] = rng.random(60)[:, None]
    raster = rasterize(corners.reshape(-1, 3), 64)
    expected = np.full((64, 64), -1)
    x = (np.arange(64) + 0.5) / 32 - 1
    points = np.stack(np.meshgrid(x, -x), axis=-1)
    for face in np.argsort(corners[:, 0, 2]):  # from the farthest on
        a, b, c = corners[face, :, :2]
        crosses = [
            (q - p)[0] * (points - p)[..., 1] - (q - p)[1] * (points - p)[..., 0]
            for p, q in ((a, b), (b, c), (c, a))
        ]
        inside = np.all(np.array(crosses) >= 0, axis=0) | np.all(np.array(crosses) <= 0, axis=0)
        expected[inside] = face
    got = np.full(64 * 64, -1)
    got[raster.pixel] = raster.face
    np.testing.assert_array_equal(got.reshape(64, 64), expected)


def test_rasterizer_of_nothing_that_can_be_seen():
    assert len(rasterize(np.zeros((3, 3)), 16).pixel) == 0
    assert len(rasterize(np.full((3, 3), 7.0), 16).pixel) == 0
