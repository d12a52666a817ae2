import numpy as np
import pytest
from scipy.stats import binomtest

from benchmarks import noise, precision
from cembench.results.comparison import compare_ratios
from cembench.results.intervals import ERROR, share
from cembench.results.multiple_testing import corrected, holm, sign_test


def test_holm_multiplies_by_what_is_left_and_keeps_the_order():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


def test_a_verdict_that_many_comparisons_do_not_bear_is_taken_back():
    sure = compare_ratios([20 + k / 4 for k in range(6)])
    unsure = compare_ratios([1.02, 1.05, 1.3, 1.9, 2.5, 1.6])
    few = compare_ratios([2.0])
    assert [one.verdict for one in corrected([unsure])] == ["slower"]
    together = corrected([sure, unsure, unsure, few])
    verdicts = [one.verdict for one in together]
    assert verdicts == ["slower", "undecided", "undecided", "too few rounds"]
    assert together[1].interval == unsure.interval
    assert corrected([sure, None, unsure, unsure, few]) == [together[0], None, *together[1:]]


def test_of_a_hundred_equal_algorithms_one_is_called_different_in_5_percent_of_tables():
    rng = np.random.default_rng(1)
    items = [precision.family_error(model, 40_000, rng) for model in noise.MODELS]
    assert max(items) <= ERROR + 0.03  # two standard deviations of the rarest event


def test_one_of_a_hundred_is_found_where_it_is_clear():
    rng = np.random.default_rng(1)
    equal = [compare_ratios(row) for row in rng.lognormal(0, 0.05, (99, 7))]
    clear = compare_ratios(2.0 * rng.lognormal(0, 0.05, 7), share(7))
    assert corrected([*equal, clear])[-1].verdict == "slower"


@pytest.mark.parametrize(("wins", "losses"), [(20, 0), (9, 3), (3, 9), (1, 0)])
def test_the_sign_test_is_the_binomial_one(wins, losses):
    assert sign_test(wins, losses) == pytest.approx(binomtest(wins, wins + losses).pvalue)
    assert sign_test(0, 0) == 1
