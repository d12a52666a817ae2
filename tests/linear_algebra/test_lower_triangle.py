import numpy as np
import pytest
from scipy import sparse

from cembench.linear_algebra.backends import available_backends
from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
from cembench.linear_algebra.lower_triangle import both_triangles, permuted_lower


@pytest.fixture
def A():
    rng = np.random.default_rng(0)
    M = sparse.random_array((40, 40), density=0.08, rng=rng)
    return sparse.csr_array(M @ M.T + sparse.eye_array(40))


@pytest.mark.parametrize("k", [40, 39, 7, 1])
def test_it_is_the_lower_triangle_of_the_permuted_matrix(A, k):
    order = np.random.default_rng(1).permutation(40)[:k]
    lower = permuted_lower(A, order)
    expected = A.toarray()[np.ix_(order, order)]
    np.testing.assert_array_equal(lower.toarray(), np.tril(expected))
    np.testing.assert_array_equal(both_triangles(lower).toarray(), expected)
    for c in range(k):
        assert (np.diff(lower.indices[lower.indptr[c] : lower.indptr[c + 1]]) > 0).all()
    assert lower.indices.dtype == np.int32


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
def test_a_lower_triangle_alone_gives_the_same_solutions(A, backend, solves):
    b = np.arange(80.0).reshape(40, 2)
    order = np.arange(40)
    with linear_algebra(solves, backend):
        whole = Cholesky(A, leading=30)
        lower = Cholesky(permuted_lower(A, order), leading=30, lower=True)
        for ask in ("solve", "condensed", "schur_solved", "solve_trailing"):
            rows = 10 if ask == "schur_solved" else 40
            found, expected = (getattr(one, ask)(b[:rows]) for one in (lower, whole))
            np.testing.assert_allclose(found, expected, rtol=1e-12)
        for ask in ("schur_times", "extended"):
            found, expected = (getattr(one, ask)(b[:10]) for one in (lower, whole))
            np.testing.assert_allclose(found, expected, rtol=1e-12)
        np.testing.assert_allclose(lower.schur_factor(), whole.schur_factor(), rtol=1e-12)


@pytest.mark.parametrize("backend", available_backends())
def test_the_next_matrix_is_given_by_its_lower_triangle_too(A, backend):
    b = np.ones(40)
    with linear_algebra(backend=backend):
        factor = Cholesky(permuted_lower(A, np.arange(40)), lower=True)
        factor.update(permuted_lower(2 * A, np.arange(40)))
        np.testing.assert_allclose(factor.solve(b), Cholesky(2 * A).solve(b), rtol=1e-12)
