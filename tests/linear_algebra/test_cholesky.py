import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench.conformal.laplacian import laplacian
from cembench.core.errors import NotPositiveDefinite, ParameterError
from cembench.linear_algebra.cholesky import (
    Cholesky,
    available_backends,
    linear_algebra,
)
from cembench.linear_algebra.cholmod import CholmodFactor

BACKENDS = available_backends()
BOTH = ("reuse", "backslash")


@pytest.fixture(scope="module")
def matrix():
    mesh = hemi_ellipsoid(2000)
    order = np.concatenate([mesh.interior, mesh.boundary])
    L = sparse.csr_array(laplacian(mesh))[order][:, order]
    return sparse.csc_array(L[:-1, :-1]), len(mesh.interior)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("solves", BOTH)
def test_solutions_satisfy_their_systems(matrix, backend, solves):
    A, k = matrix
    rng = np.random.default_rng(0)
    with linear_algebra(solves, backend):
        factor = Cholesky(A, leading=k)
        for b in (
            rng.standard_normal(A.shape[0]),
            rng.standard_normal((A.shape[0], 3)),
            rng.standard_normal(A.shape[0]) * (1 + 2j),
        ):
            x = factor.solve(b)
            assert x.shape == b.shape
            assert x.dtype == b.dtype
            assert abs(A @ x - b).max() < 1e-9 * abs(x).max()
            y = factor.solve_leading(b[:k])
            assert y.dtype == b.dtype
            assert abs(A[:k, :k] @ y - b[:k]).max() < 1e-9 * abs(y).max()


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("solves", BOTH)
def test_update_turns_to_another_matrix_also_after_a_failure(matrix, backend, solves):
    A, k = matrix
    b = np.ones(A.shape[0])
    shift = sparse.csc_array(sparse.diags_array(np.full(A.shape[0], 0.5)))
    with linear_algebra(solves, backend):
        factor = Cholesky(A, leading=k)
        factor.solve_leading(b[:k])
        for B in (A + shift, 3 * A):
            factor.update(B)
            assert abs(B @ factor.solve(b) - b).max() < 1e-9
            x = factor.solve_leading(b[:k])
            assert abs(B[:k, :k] @ x - b[:k]).max() < 1e-9

        def turn_to_an_indefinite_matrix():
            factor.update(A - 100 * shift)
            factor.solve(b)

        with pytest.raises(NotPositiveDefinite, match="not positive definite"):
            turn_to_an_indefinite_matrix()
        factor.update(A)
        assert abs(A @ factor.solve(b) - b).max() < 1e-9
        x = factor.solve_leading(b[:k])
        assert abs(A[:k, :k] @ x - b[:k]).max() < 1e-9


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_indefinite_matrix_is_an_error(backend):
    A = sparse.csc_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    with linear_algebra(backend=backend), pytest.raises(NotPositiveDefinite, match="order 2"):
        Cholesky(A)


def test_reuse_factors_once_and_backslash_at_every_solve(matrix, count_calls):
    A, k = matrix
    b = np.ones(A.shape[0])
    factored = count_calls(CholmodFactor, "_factor")
    for solves, expected in (("reuse", 1), ("backslash", 20)):
        factored.clear()
        with linear_algebra(solves):
            factor = Cholesky(A, leading=k)
            for _ in range(10):
                factor.solve(b)
                factor.solve_leading(b[:k])
        assert len(factored) == expected


def test_solve_leading_needs_its_order():
    with pytest.raises(ValueError, match="leading block at construction"):
        Cholesky(sparse.eye_array(3)).solve_leading(np.ones(2))


def test_what_cannot_be_had_is_an_error(monkeypatch):
    with pytest.raises(
        ParameterError, match=r"solves='x' is unknown; allowed: 'reuse', 'backslash'"
    ):
        linear_algebra("x").__enter__()
    with pytest.raises(ParameterError, match="backend='x' is unknown"):
        linear_algebra(backend="x").__enter__()
    monkeypatch.setattr("cembench.linear_algebra.cholesky.available_backends", lambda: ["superlu"])
    with pytest.raises(ParameterError, match=r"pip install 'cembench\[pardiso\]'"):
        linear_algebra(backend="pardiso").__enter__()


def test_the_choice_ends_with_its_block(matrix):
    A, _ = matrix
    with linear_algebra("backslash", "superlu"):
        inside = Cholesky(A)
    assert inside._how.backend == "superlu"
    assert Cholesky(A)._how.backend == "cvxopt"


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("solves", BOTH)
def test_after_an_indefinite_matrix_the_next_is_solved_again(matrix, backend, solves):
    A, _ = matrix
    identity = sparse.eye_array(A.shape[0], format="csc")
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    with linear_algebra(solves, backend):
        factor = Cholesky(A)
        for k in range(3):
            with pytest.raises(NotPositiveDefinite):  # "backslash" factors at the solve
                solved_after_update(factor, A - identity, b)
            definite = A + k * identity
            x = solved_after_update(factor, definite, b)
            assert abs(definite @ x - b).max() < 1e-9 * abs(x).max()


def solved_after_update(factor, A, b):
    factor.update(A)
    return factor.solve(b)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("solves", BOTH)
def test_an_order_serves_another_matrix(matrix, backend, solves):
    A, _ = matrix
    B = sparse.csc_array(A + sparse.diags_array(np.ones(A.shape[0] - 9), offsets=9) * 1e-3)
    B = sparse.csc_array((B + B.T) / 2 + sparse.eye_array(A.shape[0]))
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    with linear_algebra(solves, backend):
        x = Cholesky(B, like=Cholesky(A)).solve(b)
    assert abs(B @ x - b).max() < 1e-9 * abs(x).max()


def test_an_order_is_not_computed_again(matrix, monkeypatch):
    A, k = matrix
    with linear_algebra(backend="cvxopt"):
        first = Cholesky(A)
        monkeypatch.setattr("cembench.linear_algebra.orderings.minimum_degree", None)
        second = Cholesky(2 * A, like=first)
        with pytest.raises(ValueError, match="leading block"):
            Cholesky(A, like=first, leading=k)
    np.testing.assert_array_equal(first._kept.order, second._kept.order)
