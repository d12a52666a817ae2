"""Steps with weights that count all triangles alike."""

import numpy as np
import pytest
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh
from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.even_weights import _gradients, evened
from cembench.conformal.graded_meshes import is_graded
from cembench.conformal.metrics import angle_errors, flipped_triangles, is_disk_map
from cembench.conformal.planar import turns
from tests import gallery
from tests.campaign.hard_meshes import hard_mesh
from tests.hard_surfaces import hard_surface


def graded(side=24, decades=2):
    """A bent sheet whose edges shrink over decades towards a corner."""
    i, j, F = gallery.grid(side, side)
    x, y = (np.expm1(decades * np.log(10) * k / side) / 10**decades for k in (i, j))
    return DiskMesh.from_arrays(np.stack([x, y, np.sin(2 * x) * np.cos(3 * y)], axis=1), F)


def test_gradients_are_those_of_the_beltrami_coefficient():
    mesh = hard_surface(1)
    uv = direct_cem(mesh).uv
    gradient = _gradients(mesh)
    f_zbar, f_z = ((uv[mesh.F] * one / 2).sum(axis=1) for one in (gradient, np.conj(gradient)))
    own = np.abs(beltrami_coefficients(uv, mesh.F, mesh.V))  # of the inverse: the same modulus
    np.testing.assert_allclose(np.abs(f_zbar / f_z), own, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("mesh", [graded(), hard_surface(4)], ids=["graded", "hard"])
def test_each_step_lowers_the_mean_angle_error_and_keeps_the_map_valid(mesh):
    uv = direct_cem(mesh).uv
    errors = [angle_errors(mesh, uv).mean()]
    for _ in range(3):
        uv, taken = evened(mesh, uv, 1)
        errors.append(angle_errors(mesh, uv).mean())
        assert errors[-1] < errors[-2] or not taken
        assert not flipped_triangles(mesh, uv)
        assert is_disk_map(mesh, uv)
        assert turns(uv[mesh.boundary])[0] == 1
    assert errors[-1] < errors[0]


def test_on_a_graded_mesh_it_pays():
    mesh = graded(decades=3)
    before, after = direct_cem(mesh, even=0), direct_cem(mesh, even=10)
    ratio = angle_errors(mesh, after.uv).mean() / angle_errors(mesh, before.uv).mean()
    assert ratio < 0.985
    assert 1 <= after.extras["even_steps"] <= 10
    assert "even_steps" not in before.extras


def test_by_default_steps_are_taken_on_graded_meshes_alone():
    for mesh, steps in ((graded(decades=3), 2), (hard_surface(4), 0)):
        assert is_graded(mesh) == bool(steps)
        own = direct_cem(mesh)
        assert own.extras.get("even_steps", 0) == steps
        np.testing.assert_array_equal(own.uv, direct_cem(mesh, even=steps).uv)


def test_a_conformal_map_stays():
    mesh = flat_disk(400)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    uv, taken = evened(mesh, z, 5)
    assert taken == 0
    np.testing.assert_array_equal(uv, z)


def test_no_step_lets_an_arc_of_the_boundary_go_backward():
    _, V, F = hard_mesh(6, 2160)
    mesh = DiskMesh.from_arrays(V, F)
    uv, taken = evened(mesh, angle_gauge(mesh, cetm_flips(mesh).uv), 10)
    assert taken
    assert turns(uv[mesh.boundary])[2] == 0
