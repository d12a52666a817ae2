import numpy as np
import pytest

from benchmarks import noise, precision
from cembench.results.intervals import ERROR, LOOKS, is_look, next_look, share, share_of
from cembench.results.rank_tests import cut
from tests.records import record_of


def test_all_looks_together_spend_the_error_and_each_can_exclude_something():
    assert sum(share(n) for n in LOOKS) == pytest.approx(1)
    assert all(cut(n, ERROR * share(n)) >= 0 for n in (LOOKS[0], *range(LOOKS[1], LOOKS[-1] + 1)))


def test_looks_end_where_the_rounds_do():
    assert [next_look(n, 25) for n in (0, 6, 7, 20)] == [7, 7, 10, 25]
    assert is_look(25, 25)
    assert not is_look(25, 56)


def test_a_fixed_number_of_rounds_is_not_paid_for():
    fixed = record_of([1.0]).cell
    precise = record_of([1.0], repeats=0, precision=0.05).cell
    assert share_of(12, fixed) == 1
    assert share_of(12, fixed, precise) == share(12) < 0.1


@pytest.mark.parametrize("model", noise.MODELS)
def test_equal_algorithms_are_called_different_in_at_most_5_percent(model):
    simulated = precision.simulate(model, 1200, 0.05, most=40, seed=3)
    assert simulated.wrong.mean() <= ERROR
    assert simulated.ever_wrong.mean() <= ERROR + 0.01  # two standard deviations


def test_looking_without_paying_would_be_wrong_more_often_than_stated():
    """Why the error is shared out: the single interval at every look, at the full level."""
    seconds = np.log(noise.pairs("lognormal, 8 %", np.random.default_rng(3), 1200, 40))
    ever = np.zeros(1200, dtype=bool)
    for n in precision.looks(40):
        low, high = precision.intervals(seconds[:, :n, 0] - seconds[:, :n, 1], ERROR)
        ever |= (low > 0) | (high < 0)
    assert ever.mean() > 2 * ERROR


def test_a_quiet_machine_takes_few_rounds():
    simulated = precision.simulate("quiet (lognormal, 2 %)", 300, 0.05)
    assert simulated.precise.all()
    assert simulated.rounds.mean() < 10
