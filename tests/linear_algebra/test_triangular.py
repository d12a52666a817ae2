import numpy as np
import pytest

from cembench.linear_algebra.triangular import triangle_solved, triangle_times


@pytest.mark.parametrize("columns", [1, 4, 5, 9])  # one by one, and together
@pytest.mark.parametrize("transposed", [False, True])
def test_few_and_many_columns_alike(columns, transposed):
    rng = np.random.default_rng(columns)
    full = np.asfortranarray(rng.standard_normal((12, 12)) + 9 * np.eye(12))
    lower, X = np.tril(full), rng.standard_normal((12, columns))
    matrix = lower.T if transposed else lower
    kept = X.copy()
    # What lies above the diagonal is not read.
    np.testing.assert_allclose(triangle_times(full, X, transposed=transposed), matrix @ X)
    solved = triangle_solved(full, X, transposed=transposed)
    np.testing.assert_allclose(matrix @ solved, X, atol=1e-12)
    np.testing.assert_array_equal(X, kept)
