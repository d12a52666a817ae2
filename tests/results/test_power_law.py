import numpy as np
import pytest

from cembench.results.power_law import fit


def test_a_power_law_is_found_again_with_its_error():
    exact = [(n, 1e-6 * n**1.25) for n in (100, 1_000, 50_000, 10**6)]
    law = fit(exact)
    assert (law.factor, law.exponent) == (pytest.approx(1e-6), pytest.approx(1.25))
    assert law.error == pytest.approx(0, abs=1e-6)
    assert law.at(10_000) == pytest.approx(0.1)
    rng = np.random.default_rng(0)
    noisy = [(n, y * np.exp(rng.normal(0, 0.1))) for n, y in exact * 50]
    law = fit(noisy)
    # The standard error of a slope is the scatter over the root of the sum of squares.
    spread = np.log([n for n, _ in noisy]).std() * len(noisy) ** 0.5
    assert law.error == pytest.approx(0.1 / spread, rel=0.2)
    assert abs(law.exponent - 1.25) < 3 * law.error


def test_too_few_sizes_or_almost_equal_ones_have_no_exponent():
    assert fit([(100.0, 1.0), (200.0, 3.0)]) is None
    assert fit([(100.0, 1.0)] * 5) is None
    assert fit([(100.0, 1.0), (100.1, 2.0), (100.2, 1.0)]) is None
