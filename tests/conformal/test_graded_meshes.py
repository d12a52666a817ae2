"""Graded meshes get even steps, and their triangles are split where needles spoil a map."""

import numpy as np
import pytest
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.tin import tin

from cembench import DiskMesh
from cembench.conformal.graded_meshes import is_graded
from cembench.conformal.metrics import angle_errors, flipped_triangles, is_disk_map
from cembench.conformal.planar import turns
from tests import gallery
from tests.hard_surfaces import hard_surface


@pytest.fixture(scope="module")
def steep():
    """A survey TIN so steep that needles on its boundary spoil the map."""
    return tin(200, seed=4, relief=3)


def error(mesh, uv):
    return angle_errors(mesh, uv).mean()


def test_splits_bring_the_angles_of_a_map_that_needles_spoil_near_those_of_flips(steep):
    before, after = direct_cem(steep, splits=0), direct_cem(steep)
    best = error(steep, cetm_flips(steep).uv)
    assert error(steep, before.uv) > 1.2 * best
    assert error(steep, after.uv) < 1.1 * best
    assert "splits" not in before.extras
    assert after.extras["splits"] == 2
    assert not flipped_triangles(steep, after.uv)
    assert is_disk_map(steep, after.uv)
    assert turns(after.uv[steep.boundary])[0] == 1


def test_splits_that_do_not_pay_leave_the_map():
    mesh = tin(200, seed=2, relief=3)
    before, after = direct_cem(mesh, splits=0), direct_cem(mesh)
    assert after.extras["splits"] == 0
    np.testing.assert_array_equal(before.uv, after.uv)


def test_without_needles_nothing_is_split_unless_asked_for():
    mesh = hard_surface(4)
    assert "splits" not in direct_cem(mesh).extras
    assert direct_cem(mesh, splits=1).extras["splits"] in (0, 1)


def test_what_is_said_of_repairs_is_of_the_given_mesh(steep):
    own = direct_cem(steep, repair=False)
    assert own.extras["splits"] == 2
    assert own.extras["fold_repairs"] == 0
    assert own.extras["folded_before_repair"] == flipped_triangles(steep, own.uv)


def test_areas_that_vary_widely_are_enough_without_needles():
    i, j, F = gallery.grid(24, 24)
    turn, radius = 2 * i / 24, np.exp(-4 * j / 24)
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    assert is_graded(DiskMesh.from_arrays(np.stack([x, y, 0 * x], axis=1), F[:, ::-1]))
