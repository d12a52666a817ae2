import numpy as np
import pytest
from scipy.stats import mannwhitneyu, wilcoxon

from cembench.results.intervals import Interval
from cembench.results.rank_tests import (
    centre_interval,
    cut,
    rank_sum_distribution,
    shift_interval,
)


def test_six_values_are_the_fewest():
    assert centre_interval([1.0, 2.0, 3.0, 4.0, 5.0]) is None
    assert centre_interval([]) is None
    assert centre_interval([6.0, 2, 3, 1, 5, 4]) == Interval(1, 6)


@pytest.mark.parametrize("n", [6, 9, 15, 30])
def test_the_interval_excludes_0_where_the_test_of_scipy_rejects_it(n):
    rng = np.random.default_rng(n)
    for shift in rng.uniform(-1, 1, 30):
        values = rng.normal(shift, 1, n)
        p = wilcoxon(values, method="exact").pvalue
        assert (p > 0.05) == (0 in centre_interval(values))


@pytest.mark.parametrize("n", [6, 12, 40])
def test_it_covers_the_centre_of_even_noise_as_often_as_stated(n):
    rng = np.random.default_rng(n)
    left_out = cut(n)
    values = rng.standard_t(1.5, (2000, n))
    i, j = np.triu_indices(n)
    averages = np.sort((values[:, i] + values[:, j]) / 2, axis=1)
    missed = (averages[:, left_out] > 0) | (averages[:, -1 - left_out] < 0)
    assert missed.mean() < 0.05 + 3 * 0.005


@pytest.mark.parametrize(("n", "m"), [(6, 6), (7, 20), (1, 1)])
def test_the_interval_of_a_shift_agrees_with_the_rank_sum_test_of_scipy(n, m):
    rng = np.random.default_rng(n + m)
    for shift in rng.uniform(-2, 2, 20):
        ours, theirs = list(rng.normal(shift, 1, n)), list(rng.normal(0, 1, m))
        p = mannwhitneyu(ours, theirs, method="exact").pvalue
        interval = shift_interval(ours, theirs)
        assert (p > 0.05) == (interval is None or 0 in interval)


def test_the_distribution_of_large_samples_is_one():
    chances = rank_sum_distribution(56, 56)
    assert chances[-1] == pytest.approx(1)
    assert chances[56 * 28] == pytest.approx(0.5, abs=0.01)
