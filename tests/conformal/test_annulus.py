"""A tube of any length has its annulus, whose modulus is known."""

import numpy as np
import pytest
from cembench.surfaces.sheets import catenoid_ring

from cembench import AlgorithmFailed, HoledMesh
from cembench.conformal.annulus import annulus_map
from cembench.conformal.metrics import angle_errors, boundary_circularity, flipped_triangles
from tests import gallery


def tube(length, around=8):
    """A cylinder of circumference `around`, and so many edges long."""
    i, j, F = gallery.grid(length, around, wrap_columns=True)
    angle = 2 * np.pi * j / around
    radius = 0.5 / np.sin(np.pi / around)
    V = np.stack([radius * np.cos(angle), radius * np.sin(angle), i], axis=1)
    return HoledMesh.from_arrays(V, F)


def mapped(mesh):
    outer, (hole,) = mesh.outer_and_holes()
    return annulus_map(mesh, outer, hole), outer, hole


@pytest.mark.parametrize("length", [2, 30, 400])
def test_the_radius_of_a_long_hole_is_exact_and_nothing_folds(length):
    mesh = tube(length)
    z, outer, hole = mapped(mesh)
    assert np.abs(np.abs(z[outer]) - 1).max() < 1e-14
    exact = 2 * np.pi * length / 8
    assert -np.log(np.abs(z[hole])) == pytest.approx(np.full(len(hole), exact), rel=1e-9)
    assert not flipped_triangles(mesh, z)
    assert boundary_circularity(mesh, z) < 1e-12


def test_a_tube_beyond_doubles_is_refused():
    with pytest.raises(AlgorithmFailed, match="below what doubles hold"):
        mapped(tube(950))


def test_the_modulus_converges_at_second_order():
    def error(faces):
        z, _, hole = mapped(catenoid_ring(faces, height=2.0))
        return abs(-np.log(np.abs(z[hole[0]])) - 2)

    assert np.log2(error(800) / error(12_800)) / 2 == pytest.approx(2, abs=0.2)


def test_boundaries_of_three_vertices_go_around_their_circles():
    mesh = tube(40, around=3)
    z, outer, hole = mapped(mesh)
    for loop, sense in ((outer, 1), (hole, -1)):
        arcs = np.angle(np.roll(z[loop], -1) / z[loop]) * sense
        assert arcs == pytest.approx(np.full(3, 2 * np.pi / 3))
    assert np.isfinite(angle_errors(mesh, z)).all()
