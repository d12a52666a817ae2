import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench.conformal.laplacian import laplacian
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra import cholmod
from cembench.linear_algebra.cholesky import Cholesky, available_backends, linear_algebra
from cembench.mesh.triangle_mesh import DiskMesh
from tests import gallery


def pinned(mesh):
    order = np.concatenate([mesh.interior, *mesh.loops])
    return sparse.csc_array(laplacian(mesh)[order][:, order][:-1, :-1]), len(mesh.interior)


def schur_complement(A, k):
    A = A.toarray()
    return A[k:, k:] - A[k:, :k] @ np.linalg.solve(A[:k, :k], A[:k, k:])


def two_squares_joined_by_a_strip():
    """Its interior vertices form two pieces."""
    V, F = gallery.flat_rectangle(4, 12)
    middle = V[F].mean(axis=1)
    F = F[~((middle[:, 0] > 4) & (middle[:, 0] < 8) & (middle[:, 1] > 1))]
    used, F = np.unique(F, return_inverse=True)
    return DiskMesh.from_arrays(V[used], F.reshape(-1, 3))


MESHES = {"one piece": lambda: hemi_ellipsoid(600), "two pieces": two_squares_joined_by_a_strip}


@pytest.fixture(params=MESHES)
def system(request):
    return pinned(MESHES[request.param]())


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_it_is_the_factor_of_the_schur_complement(system, backend, solves):
    A, k = system
    with linear_algebra(solves, backend):
        C = Cholesky(A, leading=k).schur_factor()
    np.testing.assert_allclose(C @ C.T, schur_complement(A, k), atol=1e-12)
    np.testing.assert_array_equal(C, np.tril(C))
    assert (np.diag(C) > 0).all()


def test_the_factor_shows_it_without_a_solve(system, count_calls):
    A, k = system
    solved = count_calls(cholmod.CholmodFactor, "solve_leading")
    Cholesky(A, leading=k).schur_factor()
    assert not solved


def test_where_the_factor_cannot_be_seen_it_is_solved_for(system, monkeypatch):
    A, k = system
    monkeypatch.setattr(cholmod, "trailing_block", lambda *_: None)
    C = Cholesky(A, leading=k).schur_factor()
    np.testing.assert_allclose(C @ C.T, schur_complement(A, k), atol=1e-12)


def test_it_follows_an_update(system):
    A, k = system
    factor = Cholesky(A, leading=k)
    factor.update(4 * A)
    np.testing.assert_allclose(factor.schur_factor(), 2 * Cholesky(A, leading=k).schur_factor())


@pytest.mark.parametrize("backend", available_backends())
def test_a_leading_block_in_several_pieces_is_solved_with(backend):
    A, k = pinned(two_squares_joined_by_a_strip())
    right = np.random.default_rng(0).standard_normal((k, 2))
    with linear_algebra(backend=backend):
        found = Cholesky(A, leading=k).solve_leading(right)
    np.testing.assert_allclose(A[:k, :k] @ found, right, atol=1e-12)


def test_an_indefinite_schur_complement_is_refused():
    A = sparse.csc_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    with linear_algebra("backslash"), pytest.raises(NotPositiveDefinite, match="Schur"):
        Cholesky(A, leading=1).schur_factor()


def test_it_needs_a_leading_block():
    with pytest.raises(ValueError, match="at construction"):
        Cholesky(sparse.csc_array(np.eye(3))).schur_factor()


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_half_solves_condense_a_right_hand_side_and_extend_a_boundary(system, backend, solves):
    A, k = system
    rng = np.random.default_rng(1)
    b, x = rng.standard_normal((A.shape[0], 3)), rng.standard_normal(A.shape[0] - k) * (1 + 2j)
    dense = A.toarray()
    with linear_algebra(solves, backend):
        factor = Cholesky(A, leading=k)
        condensed, extended = factor.condensed(b), factor.extended(x)
    left = b[k:] - dense[k:, :k] @ np.linalg.solve(dense[:k, :k], b[:k])
    np.testing.assert_allclose(condensed, left, atol=1e-10)
    np.testing.assert_allclose(dense[:k, :k] @ extended, -dense[:k, k:] @ x, atol=1e-10)


def test_half_solves_do_without_a_factor_that_can_be_seen(system, monkeypatch):
    A, k = system
    b = np.random.default_rng(1).standard_normal((A.shape[0], 2))
    expected = Cholesky(A, leading=k).condensed(b), Cholesky(A, leading=k).extended(b[k:])
    monkeypatch.setattr(cholmod, "trailing_block", lambda *_: None)
    found = Cholesky(A, leading=k).condensed(b), Cholesky(A, leading=k).extended(b[k:])
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)
