"""Survey TINs have the needles that make maps hard, and direct-cem copes with them."""

import numpy as np
import pytest
from cembench.algorithms.bff.disk import bff
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.fdm import fdm
from cembench.surfaces.tin import tin

from cembench.conformal.metrics import angle_errors, corner_angles, flipped_triangles, surface_areas


def test_it_has_needles_and_long_and_short_boundary_edges():
    mesh = tin(3000, seed=1)
    areas = surface_areas(mesh)
    assert areas.min() < 1e-5 * areas.mean()
    assert (corner_angles(mesh.V, mesh.F).min(axis=1) < 5).mean() > 0.2
    edges = np.linalg.norm(mesh.V[mesh.boundary] - mesh.V[np.roll(mesh.boundary, 1)], axis=1)
    assert edges.max() > 100 * edges.min()
    assert abs(mesh.m - 3000) < 450
    assert tin(3000, seed=1).hash == mesh.hash != tin(3000, seed=2).hash


@pytest.mark.parametrize("seed", range(3))
def test_direct_cem_has_smaller_angle_errors_than_other_disk_maps(seed):
    mesh = tin(2000, seed=seed)
    own, *others = (angle_errors(mesh, one(mesh).uv).mean() for one in (direct_cem, bff, fdm))
    print(own, others)
    assert own < min(others)


@pytest.mark.parametrize("seed", [0, 3])
def test_the_descent_ends_by_its_gradient_and_folds_cost_less_than_a_degree(seed):
    """Arcs that must be held are far below the mean arc, and some only beside others."""
    mesh = tin(8000, seed=seed, twins=0.1, relief=1.0)
    own = direct_cem(mesh, repair=False, even=0)
    assert own.extras["stopped"] == "gradient"
    assert own.iterations < 10
    assert own.extras["held_arcs"] > 5
    assert flipped_triangles(mesh, own.uv)
    result = direct_cem(mesh, even=0)
    assert not flipped_triangles(mesh, result.uv)
    errors = [angle_errors(mesh, one.uv).mean() for one in (own, result)]
    assert errors[1] < errors[0] + 1
