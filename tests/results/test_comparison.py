import numpy as np
import pytest

from cembench.results.columns import rows
from cembench.results.comparison import (
    circumstances,
    compare,
    compare_cpu,
    compare_ratios,
    is_unstable,
    reference_of,
    references,
)
from cembench.results.machines import COMPARED, differences
from cembench.results.multiple_testing import corrected
from cembench.results.records import (
    DEFAULT_ROUNDS,
    External,
    Round,
)
from cembench.results.runs_compared import compare_runs
from tests.records import changed, record_of


def test_the_speedup_is_eq_33_with_its_interval():
    comparison = compare(record_of([3.0, 3.3, 2.7, 3.0, 3.0, 3.0]), record_of([1.0] * 6))
    assert comparison.speedup == pytest.approx(2)
    assert comparison.speedup_interval.low == pytest.approx(1.7)
    assert comparison.speedup_interval.high == pytest.approx(2.3)
    assert comparison.verdict == "slower"
    assert compare(record_of([1.0] * 6), record_of([2.0] * 6)).verdict == "faster"


def test_what_slows_both_cancels():
    drift = np.array([1, 2, 4, 8, 16, 32.0])
    comparison = compare(record_of(1.1 * drift), record_of(drift))
    assert comparison.verdict == "slower"
    assert comparison.interval.high == pytest.approx(1.1)


@pytest.mark.parametrize(
    ("ours", "theirs", "verdict", "rounds"),
    [
        (record_of([1.0] * 5), record_of([2.0] * 5), "too few rounds", 5),
        (record_of([1, 1, 1, 1, 1, 3.0]), record_of([2.0] * 6), "undecided", 6),
        (record_of([1.0] * 6, ["x"] * 6), record_of([2.0] * 6), "not side by side", 0),
        (record_of([1.0] * 7, [*"sssssss"]), record_of([2.0] * 7, [*"xssssss"]), "faster", 6),
    ],
)
def test_nothing_is_said_that_is_not_shown(ours, theirs, verdict, rounds):
    comparison = compare(ours, theirs)
    assert (comparison.verdict, comparison.rounds) == (verdict, rounds)


def shared(seconds, together, **cell):
    return changed(record_of(seconds, **cell), {"together": [(t,) for t in together]})


NOISE = np.array([1.2, 0.8, 1.1, 0.9, 1.3, 0.7, 1.0])


@pytest.mark.parametrize(
    ("separate", "within", "found"),
    [
        # The two agree, and the shared ones are narrower: they decide.
        (0.95 * NOISE, 0.95 + 0.01 * NOISE, ("faster", True)),
        # One disturbs the other where they share a process: "faster" there alone is nothing.
        (1 + 0.01 * NOISE, 0.7 + 0.01 * NOISE, ("undecided", False)),
        (NOISE, 0.2 + 0.01 * NOISE, ("undecided", False)),
        # It does, but is faster without that, too.
        (0.5 + 0.01 * NOISE, 0.4 + 0.01 * NOISE, ("faster", False)),
    ],
)
def test_shared_processes_decide_only_what_separate_ones_do_not_deny(separate, within, found):
    ones = [1.0] * len(NOISE)
    one = compare(shared(separate, within), shared(ones, ones))
    assert (one.verdict, one.together) == found
    assert one.disturbance is not None


def test_shared_processes_count_only_where_each_round_has_one():
    ours, theirs = shared(NOISE, NOISE), shared(NOISE, NOISE)
    rounds = (*theirs.outcome.rounds[:-1], Round(calls=(1.0,), sitting="s"))
    assert not compare(ours, changed(theirs, outcome={"rounds": rounds})).together


def compared_runs(before, after):
    """Compare two runs of these records."""
    return compare_runs(rows(before), rows(after))


def test_there_is_no_comparison_without_times():
    assert compare(record_of([]), record_of([1.0])) is None
    assert compared_runs([record_of([])], [record_of([1.0])]) == []


def test_swapping_both_inverts_the_ratio():
    ratios = np.array([0.5, 0.9, 1.3, 2.0, 4.0, 5.0])
    assert compare_ratios(ratios).ratio == pytest.approx(1 / compare_ratios(1 / ratios).ratio)


def noisy_seconds(rng, runs, rounds):
    """Two algorithms of one cost: lognormal noise, spikes, a steady drift and a step within the
    run; which of both is measured first in a round is random."""
    time = np.arange(2 * rounds) + rng.uniform(-0.5, 0.5, (runs, 1))
    drift = np.exp(rng.normal(0, 0.05, (runs, 1)) * time)
    step = np.where(time > rng.uniform(0, 2 * rounds, (runs, 1)), rng.uniform(1, 1.5, (runs, 1)), 1)
    spikes = np.where(rng.random((runs, 2 * rounds)) < 0.05, 3.0, 1.0)
    noise = rng.lognormal(0, 0.1, (runs, 2 * rounds))
    pairs = (drift * step * spikes * noise).reshape(runs, rounds, 2)
    return rng.permuted(pairs, axis=2)


@pytest.mark.parametrize("rounds", [DEFAULT_ROUNDS, 9, 15])
def test_equal_algorithms_are_told_apart_in_at_most_5_percent(rounds):
    rng = np.random.default_rng(7)
    pairs = noisy_seconds(rng, 4000, rounds)
    verdicts = [compare_ratios(ours / theirs).verdict for ours, theirs in pairs.transpose(0, 2, 1)]
    wrong = np.mean([verdict != "undecided" for verdict in verdicts])
    assert wrong < 0.06, f"{wrong:.1%} of {len(verdicts)}"  # 5 % and three standard deviations


def test_a_bootstrap_of_six_rounds_would_be_wrong_more_often_than_it_says():
    """Why the interval is not one: resampled means of six ratios lie too close together."""
    rng = np.random.default_rng(7)
    pairs = np.log(noisy_seconds(rng, 1000, DEFAULT_ROUNDS))
    differences = pairs[:, :, 0] - pairs[:, :, 1]
    drawn = rng.integers(0, DEFAULT_ROUNDS, (1000, 400, DEFAULT_ROUNDS))
    means = np.take_along_axis(differences[:, None, :], drawn, axis=2).mean(axis=2)
    low, high = np.percentile(means, [2.5, 97.5], axis=1)
    assert np.mean((low > 0) | (high < 0)) > 0.05


def test_a_true_difference_is_found():
    rng = np.random.default_rng(7)
    items = [compare_ratios(1.5 * rng.lognormal(0, 0.1, 6)).verdict for _ in range(200)]
    assert items.count("slower") > 190


def test_a_figure_is_unstable_where_its_interval_is_wide():
    assert is_unstable(record_of([1, 1, 1, 1, 1, 1.3]))
    assert not is_unstable(record_of([1, 1, 1, 1, 1, 1.09]))
    assert not is_unstable(record_of([1, 2]))


def test_two_runs_compare_cell_by_cell():
    before = [record_of([2.0, 2.1, 2.2, 2.0, 2.1, 2.0]), record_of([1.0] * 6, solves="backslash")]
    after = [record_of([1.0] * 6, code_hash="other"), record_of([1.0] * 6, threads=2)]
    (change,) = compared_runs(before, after)
    assert change.comparison.verdict == "faster"
    interval = change.comparison.interval
    assert (interval.low, interval.high) == (pytest.approx(1 / 2.2), pytest.approx(0.5))
    assert change.drift is None
    (few,) = compared_runs([record_of([1.0])], [record_of([2.0])])
    assert few.comparison.verdict == "too few rounds"


def test_machines_differ_in_what_changes_seconds():
    one = {"cpu": "x", "cores": 2, "git": "a"}
    assert differences(one, one | {"git": "b"}, COMPARED) == []
    assert differences(one, one | {"cpu": "y"}, COMPARED) == ["cpu: x / y"]
    libraries = {"libraries": {"numpy": "2.4", "scipy": "1.16"}}
    other = {"libraries": {"numpy": "2.5", "scipy": "1.16"}}
    assert differences(libraries, other, COMPARED) == ["numpy: 2.4 / 2.5"]
    pages = {"allocator": {"huge_pages": "madvise"}}
    assert differences({}, pages, COMPARED) == ["huge_pages: None / madvise"]


def with_cpu(record, seconds):
    return changed(record, {"cpu_seconds": seconds})


def test_cpu_seconds_are_compared_within_rounds_whatever_the_wall_clock_says():
    drift = [1.0, 2.0, 4.0, 1.0, 3.0, 1.0]
    ours = with_cpu(record_of([1.0] * 6), [3 * d for d in drift])
    theirs = with_cpu(record_of([9.0] * 6), drift)
    comparison = compare_cpu(ours, theirs)
    assert comparison.ratio == pytest.approx(3)
    assert (comparison.verdict, comparison.rounds) == ("slower", 6)
    assert compare(ours, theirs).verdict == "faster"


@pytest.mark.parametrize("lost", [None, 0.0])
def test_cpu_seconds_are_not_compared_where_a_round_shows_none(lost):
    ours = with_cpu(record_of([1.0] * 6), [1.0] * 5 + [lost])
    theirs = with_cpu(record_of([1.0] * 6), [1.0] * 6)
    assert compare_cpu(ours, theirs) is None
    assert compare_cpu(theirs, ours) is None


def test_cpu_seconds_of_a_program_are_not_compared():
    ours, theirs = (with_cpu(record_of([1.0] * 6), [1.0] * 6) for _ in range(2))
    program = changed(ours, external=External(kind="program", name="x"))
    assert compare_cpu(program, theirs) is None
    assert compare_cpu(theirs, program) is None
    assert compare_cpu(ours, theirs).ratio == 1


def test_the_reference_is_the_one_whose_parameters_most_cells_have():
    usual, other = {"inversion": True}, {"inversion": False}
    records = [
        record_of([1.0], algorithm="cem", parameters=how, mesh_hash=place)
        for how, place in ((usual, "a"), (usual, "b"), (other, "b"))
    ]
    chosen = references(records, "cem")
    assert list(chosen.values()) == [[records[0]], [records[1]]]
    assert references([records[2]], "cem")[circumstances(records[2].cell)] == [records[2]]
    assert list(references(records[1:], "cem").values()) == [[records[1]]]


def test_a_row_is_compared_with_the_reference_of_its_own_sitting():
    def sitting(name, rounds, algorithm):
        record = record_of([1.0] * rounds, [name] * rounds, algorithm=algorithm, repeats=rounds)
        return record.model_copy(update={"started_at": name})

    run = [sitting(s, n, a) for a in ("cem", "mine") for s, n in (("1", 6), ("2", 7))]
    for records in (run, run[::-1]):
        said = {(r["algorithm"], r["rounds"]): r["verdict"] for r in rows(records)}
        assert said["mine", 6] == said["mine", 7] == "undecided"
    again = sitting("1", 6, "cem").model_copy(update={"started_at": "3"})
    apart = sitting("4", 6, "mine")
    for record, base in ((run[2], again), (run[3], run[1]), (apart, again)):
        assert reference_of(record, references([*run[:2], again], "cem")) is base


def test_who_maps_differently_from_process_to_process_is_called_faster_than_nobody():
    fast, slow = record_of([1.0] * 7, algorithm="a"), record_of([2.0] * 7, algorithm="b")
    scattering = changed(fast, {"differs": [False] * 6 + [True]})
    assert compare(fast, slow).verdict == "faster"
    found = compare(scattering, slow)
    assert (found.verdict, found.p, found.ratio) == ("undecided", 1.0, 0.5)
    assert corrected([found, compare(fast, slow)])[0].verdict == "undecided"
    assert compare(slow, scattering).verdict == "undecided"
    assert compare(changed(slow, {"differs": [True] * 7}), fast).verdict == "slower"
