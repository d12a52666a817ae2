import pytest

from cembench.results.records import Neighbours
from cembench.results.stability import stability_words
from tests.records import changed, record_of

STEADY, SHAKY, FEW = [1.0] * 7, [1, 1.2, 0.9, 1.1, 1, 1.3, 1], [1.0, 1.1]


def timed(seconds, ended=None, busy=0, precision=0.05):
    settings = {"precision": precision, "repeats": 0} if precision else {}
    cores = [1.0 if k < busy else 0.0 for k in range(len(seconds))]
    each = {"neighbours": [Neighbours(other_cores=one) for one in cores]}
    return changed(record_of(seconds, **settings), each, outcome={"ended": ended})


def test_unstable_times_are_counted_with_what_ended_them():
    records = [
        *[timed(STEADY, "precise")] * 3,
        *[timed(SHAKY, "rounds", busy=2)] * 2,
        timed(SHAKY, "budget", busy=1),
        timed(FEW, "budget"),
    ]
    assert stability_words(records) == (
        "3 of 7 times are unstable (95 % interval wider than 25% of the figure): 2 as the maximum "
        "number of rounds was reached, 1 as the time was used up; 2 of them measured beside other "
        "work. 1 has too few rounds for an interval: the time was used up."
    )


@pytest.mark.parametrize(
    ("record", "why"),
    [
        (timed(SHAKY, precision=None), "their number of rounds was fixed"),
        (timed(SHAKY, "precise", precision=0.4), "a precision that allows it was asked for"),
    ],
)
def test_what_ended_other_cells_is_said_too(record, why):
    assert stability_words([record]).endswith(f"of the figure): {why}.")


def test_without_any_interval_nothing_is_called_stable():
    assert stability_words([timed(FEW, precision=None)] * 3) == (
        "Each cell was timed at most 2 times, so no intervals are given: their number of rounds "
        "was fixed."
    )


def test_nothing_is_said_of_what_was_not_timed():
    assert stability_words([record_of([])]) == ""
    assert stability_words([timed(STEADY, "precise")]).startswith("None of 1 time is unstable (")
