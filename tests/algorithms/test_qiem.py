import numpy as np
import pytest
from cembench.algorithms import qiem as module
from cembench.algorithms.qiem import qiem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.doubling import doubled_surface
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.linear_algebra.cholmod import CholmodFactor


@pytest.fixture(scope="module")
def L():
    return doubled_surface(hemi_ellipsoid(150))[2]


def test_a_step_is_the_quasi_implicit_one(L):
    n = L.shape[0]
    S = np.random.default_rng(0).standard_normal((n, 3))
    D = np.random.default_rng(1).random(n)
    step = module._Step(L)
    for dt in (0.1, 0.3):
        dense = np.eye(n) + dt * (L.toarray() - np.diag(D))
        np.testing.assert_allclose(step(S, D, dt), np.linalg.solve(dense, S), atol=1e-10)


@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_too_long_a_step_is_no_error_and_a_shorter_one_works(L, solves):
    n = L.shape[0]
    S, D = np.random.default_rng(0).standard_normal((n, 3)), np.ones(n)
    with linear_algebra(solves):
        step = module._Step(L)
        assert step(S, D, 10.0) is None
        dense = np.eye(n) + 0.1 * (L.toarray() - np.diag(D))
        np.testing.assert_allclose(step(S, D, 0.1), np.linalg.solve(dense, S), atol=1e-10)


def test_the_energy_falls_from_step_to_step():
    result = qiem(hemi_ellipsoid(2000))
    assert result.iterations > 5
    assert (np.diff(result.energy_history) <= 0).all()


def test_the_symbolic_analysis_of_the_flow_is_done_once(count_calls):
    mesh = hemi_ellipsoid(600)
    analysed = count_calls(CholmodFactor, "_analyse")
    factored = count_calls(CholmodFactor, "_factor")
    result = qiem(mesh)
    assert result.iterations > 10
    assert len(factored) > result.iterations
    assert len(analysed) <= 3  # the start, the flow, the last Dirichlet solve
    analysed.clear()
    with linear_algebra("backslash"):
        qiem(mesh)
    assert len(analysed) > result.iterations
