import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench.conformal import bordered
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import flipped_triangles
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.linear_algebra import cholesky, cholmod
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


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_what_stands_behind_the_leading_block_is_that_of_the_whole_solution(
    system, backend, solves
):
    A, k = system
    b = np.random.default_rng(0).standard_normal((len(A.toarray()), 2)) @ [1, 1j]
    with linear_algebra(solves, backend):
        solved = Cholesky(A, leading=k).solve_trailing(b)
    np.testing.assert_allclose(solved, np.linalg.solve(A.toarray(), b)[k:], atol=1e-11)


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
        solved = Cholesky(A, leading=k).solve_leading(right)
    np.testing.assert_allclose(A[:k, :k] @ solved, right, atol=1e-12)


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


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_products_of_a_schur_complement_that_is_too_large_for_its_factor(
    system, backend, solves, monkeypatch
):
    A, k = system
    S = schur_complement(A, k)
    x = np.random.default_rng(2).standard_normal((len(S), 2))
    monkeypatch.setattr(cholesky, "LARGEST_DENSE", len(S) - 1)
    with linear_algebra(solves, backend):
        factor = Cholesky(A, leading=k)
        np.testing.assert_allclose(factor.schur_times(x), S @ x, atol=1e-10)
        np.testing.assert_allclose(factor.schur_solved(S @ x), x, atol=1e-9)
        C = factor.schur_factor()
    np.testing.assert_allclose(C @ C.T, S, atol=1e-12)


def spiral(turns=16, columns=3200):
    """A narrow strip, rolled up: nearly all that it has is boundary."""
    i, j, F = gallery.grid(2, columns)
    angle = 2 * np.pi * turns * j / columns
    radius = 1 + angle / 4 + 0.2 * i
    z = radius * np.exp(1j * angle)
    return DiskMesh.from_arrays(np.stack([z.real, z.imag, 0 * z.real], 1), F[:, ::-1])


@pytest.mark.parametrize("function", [cem, direct_cem])
def test_a_long_boundary_never_becomes_a_dense_matrix(function, monkeypatch):
    mesh = spiral()
    assert len(mesh.boundary) > cholesky.LARGEST_DENSE

    def dense(*_):
        raise AssertionError("the boundary's matrix was made dense")

    monkeypatch.setattr(cholmod, "trailing_block", dense)
    monkeypatch.setattr(Cholesky, "schur_factor", dense)
    monkeypatch.setattr(
        cholmod.CholmodFactor,
        "solve_leading",
        dense,  # of a factor whose trailing block has filled up
    )
    try:
        uv = function(mesh).uv
    except AlgorithmFailed:
        assert function is cem  # its start puts such a boundary out of order
    else:
        assert flipped_triangles(mesh, uv) == 0


def test_direct_cem_minimises_the_same_energy_without_the_dense_factor(monkeypatch):
    mesh = hemi_ellipsoid(600)
    expected = direct_cem(mesh)
    for module in (cholesky, bordered):
        monkeypatch.setattr(module, "LARGEST_DENSE", 1)
    result = direct_cem(mesh)
    np.testing.assert_allclose(result.energy_history, expected.energy_history, rtol=1e-9)
    np.testing.assert_allclose(result.uv, expected.uv, atol=1e-6)
