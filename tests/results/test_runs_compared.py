import numpy as np
import pytest

from cembench.results.runs_compared import compare_runs
from tests.results.test_comparison import record_of


def measured(seconds, kernel):
    record = record_of(list(seconds))
    rounds = tuple(
        one.model_copy(update={"kernel_seconds": float(k)})
        for one, k in zip(record.outcome.rounds, kernel, strict=True)
    )
    return record.model_copy(
        update={"outcome": record.outcome.model_copy(update={"rounds": rounds})}
    )


def test_a_machine_that_became_slower_is_not_the_algorithm_s_fault():
    rng = np.random.default_rng(2)
    slow = 1.5 * rng.lognormal(0, 0.02, 8)
    before = measured(rng.lognormal(0, 0.02, 8), [1.0] * 8)
    (same,) = compare_runs([before], [measured(slow, [1.5] * 8)])
    assert same.drift == pytest.approx(1.5)
    assert same.comparison.verdict == "undecided"
    assert same.comparison.ratio == pytest.approx(1, abs=0.05)
    (changed,) = compare_runs([before], [measured(slow, [1.0] * 8)])
    assert changed.comparison.verdict == "slower"


def test_what_the_kernel_scatters_widens_the_interval():
    rng = np.random.default_rng(3)
    seconds = rng.lognormal(0, 0.02, (2, 8))
    widths = []
    for scatter in (0.0, 0.3):
        kernels = rng.lognormal(0, scatter, (2, 8))
        (change,) = compare_runs(*([measured(s, k)] for s, k in zip(seconds, kernels, strict=True)))
        widths.append(change.comparison.interval.high / change.comparison.interval.low)
    assert widths[1] > 1.2 * widths[0]


def test_one_run_without_a_kernel_is_enough_for_the_drift_to_be_unknown():
    (change,) = compare_runs([record_of([1.0] * 6)], [measured([1.0] * 6, [1.0] * 6)])
    assert change.drift is None
    assert change.comparison.ratio == 1


def test_equal_runs_are_called_different_in_at_most_5_percent():
    rng = np.random.default_rng(4)
    wrong = 0
    for _ in range(300):
        drift = rng.lognormal(0, 0.3, 2)
        runs = [
            [measured(d * rng.lognormal(0, 0.05, 7), d * rng.lognormal(0, 0.05, 7))] for d in drift
        ]
        wrong += compare_runs(*runs)[0].comparison.verdict != "undecided"
    assert wrong / 300 <= 0.05 + 0.026  # two standard deviations
