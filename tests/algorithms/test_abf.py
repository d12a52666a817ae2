import numpy as np
import pytest
from cembench.algorithms.abf.constraints import Angles, kept_positive
from cembench.algorithms.abf.linear import abf_linear
from cembench.algorithms.abf.plus_plus import abf_plus_plus
from cembench.algorithms.lscm import lscm
from cembench.surfaces.flat_disk import flat_disk

from cembench import AlgorithmFailed
from cembench.conformal.metrics import all_metrics, corner_angles
from cembench.mesh.files import read_mesh
from tests import gallery
from tests.hard_surfaces import hard_surface
from tests.real_meshes import real_mesh


def test_the_angles_of_any_flat_map_meet_all_constraints():
    mesh = gallery.uneven(600)
    flat = np.deg2rad(corner_angles(lscm(mesh).uv, mesh.F))
    assert max(Angles(mesh).told(flat).values()) < 1e-9


def test_a_step_is_the_least_change_that_meets_the_linear_constraints():
    """Against a dense solve of the whole optimality system, constraints from finite differences."""
    mesh = gallery.uneven(60)
    problem = Angles(mesh)
    angles = problem.wanted
    gradient = 0.1 * np.random.default_rng(0).standard_normal(angles.shape)
    D = angles**2

    def constraints(a):
        return np.concatenate(problem.residuals(a.reshape(angles.shape)))

    steps = 1e-6 * np.eye(angles.size)
    C = np.array([constraints(angles.ravel() - s) - constraints(angles.ravel() + s) for s in steps])
    C = C.T / 2e-6
    zero = np.zeros((len(C), len(C)))
    whole = np.block([[np.diag(1 / D.ravel()), C.T], [C, zero]])
    right = np.concatenate([-gradient.ravel(), constraints(angles.ravel())])
    expected = np.linalg.lstsq(whole, right, rcond=None)[0]
    e, y_w = problem.step(angles, D, gradient)
    assert abs(e.ravel() - expected[: e.size]).max() < 1e-6
    assert abs(y_w + expected[-problem.k :]).max() < 1e-4


def test_newton_meets_the_constraints_and_is_at_a_minimum():
    mesh = gallery.uneven(600)
    result = abf_plus_plus(mesh)
    assert max(result.extras[k] for k in result.extras if k.endswith("residual")) < 1e-8
    linear = abf_linear(mesh)
    assert linear.extras["triangle_residual"] < 1e-12
    assert linear.extras["vertex_residual"] < 1e-12
    assert 1e-8 < linear.extras["wheel_residual"] < 0.1
    problem = Angles(mesh)
    wanted = problem.wanted

    def cost(uv):
        return (((np.deg2rad(corner_angles(uv, mesh.F)) - wanted) / wanted) ** 2).sum()

    rng = np.random.default_rng(1)
    least = cost(result.uv)
    for _ in range(5):
        near = rng.standard_normal(mesh.n) + 1j * rng.standard_normal(mesh.n)
        assert cost(result.uv + 1e-3 * near) > least
    assert least <= cost(linear.uv)
    assert least < cost(lscm(mesh).uv)


@pytest.mark.parametrize("name", ["canonical_face.obj", "nefertiti.obj", "turtle.obj"])
def test_angles_are_below_those_of_lscm_on_real_surfaces(name):
    mesh = read_mesh(real_mesh(name))
    pinned = all_metrics(mesh, lscm(mesh).uv)["angle_error_mean_deg"]
    for f in (abf_linear, abf_plus_plus):
        assert all_metrics(mesh, f(mesh).uv)["angle_error_mean_deg"] < 1.01 * pinned


def test_no_step_takes_an_angle_to_zero():
    angles, share = kept_positive(np.array([[0.1, 1.0, 2.0]]), np.array([[-0.2, 0.1, 0.1]]))
    assert share == pytest.approx(0.45)
    assert angles.min() == pytest.approx(0.01)


def test_constraints_that_rounding_makes_dependent_are_a_failure(monkeypatch):
    mesh = hard_surface(0)
    flat = mesh.moved(mesh.V * [1.0, 1e-9, 1e-9])
    with pytest.raises(AlgorithmFailed, match=r"the sharpest angle is|not converged"):
        abf_plus_plus(flat)


def test_a_flat_surface_comes_out_as_it_is():
    mesh = flat_disk(300, stretch=2.0)
    for f in (abf_linear, abf_plus_plus):
        assert all_metrics(mesh, f(mesh).uv)["angle_error_mean_deg"] < 1e-6
