from math import comb

import numpy as np
import pytest

from cembench.results.intervals import Interval, median_interval


def test_six_values_are_the_fewest():
    assert median_interval([1, 2, 3, 4, 5]) is None
    assert median_interval([6, 2, 3, 1, 5, 4]) == Interval(1, 6)
    assert median_interval([]) is None


@pytest.mark.parametrize("n", range(6, 40))
def test_it_is_the_narrowest_that_reaches_the_level(n):
    interval = median_interval(range(n))
    cut = int(interval.low)
    assert interval == Interval(cut, n - 1 - cut)

    def outside(j):
        return 2 * sum(comb(n, k) for k in range(j + 1)) / 2**n

    assert outside(cut) <= 0.05 < outside(cut + 1)


@pytest.mark.parametrize("draw", ["lognormal", "pareto", "standard_cauchy"])
@pytest.mark.parametrize("n", [6, 9, 20])
def test_it_covers_the_median_of_any_distribution(draw, n):
    rng = np.random.default_rng(n)
    shape = (1,) if draw != "standard_cauchy" else ()
    sampler = getattr(rng, draw)
    values = sampler(*((0.0,) if draw == "lognormal" else shape), size=(4000, n))
    median = {"lognormal": 1.0, "pareto": 1.0, "standard_cauchy": 0.0}[draw]
    covered = np.mean([median in median_interval(row) for row in values])
    assert covered > 0.95 - 0.01  # one in ten thousand falls below for 4000 samples
