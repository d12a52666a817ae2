"""Rounds in which compared algorithms share a process, besides having one each."""

from itertools import chain

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

import cembench
from cembench.core.errors import ParameterError
from cembench.core.notices import NoticeKind, of_kind
from cembench.registry import load_registry
from cembench.results.comparison import compare, paired_ratios
from cembench.results.records import Fault, FaultKind, Round, not_ok
from cembench.results.stability import scatter_words
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.pairing import PROCESSES, Scatter
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.rigid_motion import THEN
from cembench.running.timing import CellTimer
from cembench.running.watcher import Watcher
from tests.records import changed
from tests.running.test_cheats import CHEATS, surface  # noqa: F401 - a fixture
from tests.running.test_schedule import Invented, cells

pytestmark = pytest.mark.usefixtures("kept_servers")


def test_the_scatter_between_processes_is_told_from_that_within_one():
    rng = np.random.default_rng(5)
    process = rng.normal(0, 0.1, 4000)
    pairs = np.exp(process[:, None] + rng.normal(0, 0.02, (4000, 2)))
    scatter = Scatter.of([tuple(pair) for pair in pairs])
    assert scatter.separate == pytest.approx(0.1 * 2**0.5, rel=0.05)
    assert scatter.together == pytest.approx(0.02 * 2**0.5, rel=0.05)
    assert scatter.pairing_is_narrower
    assert not Scatter(0.03, 0.03).pairing_is_narrower
    assert scatter.half_width(28, pairs=True) < scatter.half_width(28, pairs=False) / 4


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (10.0, "the time is not enough for the 7 rounds that an interval takes"),
        (30.0, "7 rounds of about 1 of 2 cells make ratios certain to ±"),
        (200.0, "7 rounds of each cell make ratios certain to ±"),
    ],
)
def test_a_run_says_of_how_many_cells_there_will_be_intervals(seconds, said):
    words = Scatter(0.08, 0.02).forecast([1.0, 10.0], seconds, pairs=True)
    assert "scatter by 8.0% between processes and by 2.0% within one" in words
    assert said in words


def test_the_expected_width_is_that_of_the_interval():
    rng = np.random.default_rng(6)
    widths = []
    for _ in range(200):
        ours, theirs = np.exp(rng.normal(0, 0.05, (2, 20)))
        comparison = cembench.results.comparison.compare_ratios(list(ours / theirs), 0.1)
        widths.append((comparison.interval.high - comparison.interval.low) / (2 * comparison.ratio))
    expected = Scatter(0.05 * 2**0.5, 0.0).half_width(20, pairs=False)
    assert np.median(widths) == pytest.approx(expected, rel=0.15)


class Scattering(Invented):
    """Processes differ by a tenth, calls in one by a hundredth."""

    def together(self, tasks, checked):
        process = float(self.rng.lognormal(0, 0.1))
        calls = [process * float(self.rng.lognormal(0, 0.01)) for _ in tasks]
        return [Round(calls=(seconds,)) for seconds in calls]

    def time(self, task, checked):
        seconds = float(self.rng.lognormal(0, 0.1) * self.rng.lognormal(0, 0.01))
        return Round(calls=(seconds,), uv_hash="h")


class Listening(Watcher):
    def __init__(self):
        self.said = []

    def shows(self, words):
        self.said.append(words)


def with_calls(kind):
    """A timer whose checks say what a call takes."""

    class Checked(kind):
        def check(self, task):
            outcome, uv = super().check(task)
            return outcome.model_copy(update={"rounds": (Round(calls=(1e-9,)),)}), uv

    return Checked


def many():
    """Enough cells that ten processes are a twentieth of the run."""
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in ("cem", "lscm", "fdm", "ldm", "direct-cem")]
    surfaces = [flat_disk(size).renamed(str(size)) for size in (100, 110, 120, 130, 140)]
    return plan_cells(chosen, surfaces, {}, MeasurementSettings.until_precise(0.05))


def test_where_processes_scatter_most_algorithms_share_one_and_the_run_says_what_it_buys(tmp_path):
    listening = Listening()
    options = Options(pairing="auto", most_rounds=56, budget=3600)
    tasks = many()
    records = run_tasks(tasks, Store(tmp_path), options, listening, with_calls(Scattering))
    assert "within one process of each round" in listening.said[0]
    assert "7 rounds of each cell make ratios certain to ±" in listening.said[0]
    by_name = {r.cell.algorithm: r for r in records if r.cell.mesh == "100"}
    for name in ("lscm", "fdm", "ldm"):
        comparison = compare(by_name[name], by_name["cem"])
        assert comparison.together
        assert 1 in comparison.disturbance
        assert comparison.rounds == len(paired_ratios(by_name[name], by_name["cem"])) == 7
        assert (comparison.interval.high - comparison.interval.low) / 2 < 0.05
    assert "within one process" in scatter_words(records)


def test_where_sharing_gains_nothing_nothing_is_shared(tmp_path):
    class Even(Scattering):
        def together(self, tasks, checked):
            return [self.time(task, None) for task in tasks]

    listening = Listening()
    options = Options(pairing="auto", most_rounds=10, budget=3600)
    records = run_tasks(many(), Store(tmp_path), options, listening, with_calls(Even))
    assert "between processes" in listening.said[0]
    assert not any(r.together for record in records for r in record.outcome.rounds)


def test_a_short_run_does_not_measure_its_scatter(tmp_path):
    class Never(Invented):
        def together(self, tasks, checked):
            raise AssertionError

    run_tasks(cells(), Store(tmp_path), Options(pairing="auto", budget=20), None, Never)


def test_a_shared_process_that_cannot_be_used_leaves_the_others_as_they_are(tmp_path):
    class Faulty(Scattering):
        def together(self, tasks, checked):
            return not_ok("not_comparable", Fault(kind=FaultKind.WORKS_AHEAD, detail="busy"))

    how = {"pairing": "process", "most_rounds": 10}
    records = run_tasks(cells(), Store(tmp_path), Options(**how), None, Faulty)
    for record in records:
        assert record.outcome.status == "ok"
        assert not any(r.together for r in record.outcome.rounds)
        (note,) = of_kind(NoticeKind.NOT_TOGETHER, record.outcome.notes)
        assert "round 1: busy" in note.text


def measured(names, mesh, folder, rounds, plugins=()):
    registry = load_registry(plugins)
    chosen = [registry.algorithm(name) for name in names]
    how = MeasurementSettings(repeats=rounds)
    tasks = plan_cells(chosen, [mesh], {}, how, plugins)
    records = run_tasks(tasks, Store(folder), Options(pairing="process"))
    return {record.cell.algorithm: record for record in records}


def test_every_round_has_both_kinds_of_processes(tmp_path):
    scatter = measured(["cem", "harmonic-circle"], flat_disk(300), tmp_path, 2)
    for record in scatter.values():
        assert record.outcome.status == "ok"
        for one in record.outcome.rounds:
            assert len(one.calls) > 1
            assert len(one.together) > 1
            assert one.repeated
    assert Store(tmp_path).records()[0].outcome.rounds[0].together


def test_the_calls_of_a_round_get_the_same_numbers_in_all_cells(tmp_path):
    """Seconds depend on the numbering, and ratios should not."""
    records = measured(["cem", "harmonic-circle"], flat_disk(300), tmp_path, 2).values()
    every = [[numbers(one) for one in record.outcome.rounds] for record in records]
    for own, other in zip(*every, strict=True):
        shared = min(len(own), len(other))
        assert own[:shared] == other[:shared]
    assert len(set(chain(*every[0]))) == sum(map(len, every[0]))


def numbers(one):
    """Return the numberings of a round's calls; the first call repeats one of the round before."""
    motions = [motion.partition(THEN) for motion in one.motions.split("; ")[1:]]
    return [numbering for numbering, then, _ in motions if then]


def test_one_process_makes_the_calls_of_twins(tmp_path):
    task = cells(("cem",))[0]
    timer = CellTimer(tmp_path, Options())
    try:
        outcome, _ = timer.check(task)
        checked = cembench.running.map_checks.Checked.of(outcome)
        result = timer.together([task, task], [checked, checked])
    finally:
        timer.close()
    assert len(result) == 2
    assert all(one.repeated is not False for one in result)
    assert result[0].motions != result[1].motions
    assert PROCESSES >= 10


def test_who_slows_its_neighbours_is_not_faster(surface, tmp_path):  # noqa: F811
    names = ["honest", "slows-others"]
    scatter = measured(names, surface, tmp_path / "run", 7, [str(CHEATS)])
    compared = compare(scatter["slows-others"], scatter["honest"])
    assert compared.disturbance.high < 1
    assert not compared.together
    alone = compare(*(apart(scatter[name]) for name in ("slows-others", "honest")))
    assert compared.ratio == pytest.approx(alone.ratio)
    assert compared.verdict in (alone.verdict, "undecided")


def apart(record):
    """The record without its calls in shared processes."""
    return changed(record, {"together": [()] * len(record.outcome.rounds)})


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"pairing": "both"}, "pairing='both' is not allowed; write one of 'auto'"),
        ({"pairing": "process", "cluster": "local:1"}, "for runs on this machine"),
    ],
)
def test_a_pairing_that_cannot_be_is_refused(more, said):
    with pytest.raises(ParameterError, match=said):
        cembench.benchmark(["flat-disk"], ["cem"], **more)
