import numpy as np
import pytest
from cembench.algorithms import qiem as module
from cembench.algorithms.qiem import qiem
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.doubling import doubled, doubled_laplacian
from cembench.conformal.laplacian import laplacian, non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.linear_algebra.cholmod import CholmodFactor
from tests import gallery


@pytest.fixture(scope="module")
def L():
    mesh = hemi_ellipsoid(150)
    return doubled_laplacian(laplacian(mesh), doubled(mesh))


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


def test_too_few_steps_are_a_failure_with_its_cause():
    with pytest.raises(AlgorithmFailed, match="has not converged after 3 steps"):
        qiem(hemi_ellipsoid(600), max_iterations=3)


def test_folds_are_repaired():
    crumpled = gallery.crumpled_disk()
    result = qiem(crumpled)
    assert result.extras["fold_repairs"] > 0
    assert all_metrics(crumpled, result.uv)["flipped_triangles"] == 0


def test_a_mesh_without_interior_is_refused():
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 6))
    with pytest.raises(AlgorithmFailed, match="no interior vertex"):
        qiem(strip)


@pytest.mark.parametrize("noise", [0, 0.03])
def test_delaunay_weights_change_only_what_is_not_delaunay(noise):
    mesh = flat_disk(600)
    V = mesh.V + noise * np.random.default_rng(0).standard_normal(mesh.V.shape)
    mesh = DiskMesh.from_arrays(V, mesh.F)
    assert (non_delaunay_share(mesh) > 0) == (noise > 0)
    apart = abs(qiem(mesh, delaunay=True).uv - qiem(mesh).uv).max()
    assert apart > 1e-4 if noise else apart < 1e-9
