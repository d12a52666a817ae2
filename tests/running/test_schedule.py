"""What goes on until it is precise, with invented seconds and no process at all."""

from itertools import count
from math import inf

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.registry import load_registry
from cembench.results.comparison import compare, is_unstable, paired_ratios
from cembench.results.records import Neighbours, Outcome, Round
from cembench.results.store import Store
from cembench.running import local
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.schedule import BESIDE_CALLS, affordable, cheapest, cost, lack
from cembench.running.watcher import Watcher


@pytest.fixture(autouse=True)
def _a_quick_kernel(monkeypatch):
    ticks = count(1)
    monkeypatch.setattr(local, "kernel_seconds", lambda _: next(ticks) / 1000)


def cells(names=("cem", "lscm", "fdm"), precision=0.05, **how):
    chosen = [load_registry().algorithm(name) for name in names]
    settings = MeasurementSettings.until_precise(precision, **how)
    return plan_cells(chosen, [flat_disk(100)], {}, settings)


class Invented:
    """In place of a timer: the seconds of an algorithm scatter as much as its entry says."""

    scatter = {"cem": 0.01, "lscm": 0.01, "fdm": 0.15}  # noqa: RUF012

    def __init__(self, *_):
        self.rng = np.random.default_rng(4)
        self.busy = False

    def close(self):
        pass

    def check(self, task):
        return Outcome(status="ok", uv_hash="h"), None

    def time(self, task, checked):
        scatter = self.scatter[task.cell.algorithm]
        return Round(calls=(float(self.rng.lognormal(0, scatter)),), uv_hash="h")


class Noting(Watcher):
    def __init__(self, end_at=None):
        self.expected, self.steps, self.end_at = 0, [], end_at

    def begins(self, processes):
        self.expected += processes

    def adds_rounds(self, task, rounds):
        self.expected += rounds

    def starts(self, task, step):
        if self.end_at == len(self.steps):
            raise KeyboardInterrupt
        self.steps.append((task.cell.algorithm, step.round))


def rounds_of(records):
    return {record.cell.algorithm: len(record.outcome.rounds) for record in records}


def test_what_is_precise_drops_out_and_the_reference_stays_beside_the_rest(tmp_path):
    noting = Noting()
    records = run_tasks(cells(), Store(tmp_path), Options(most_rounds=40), noting, Invented)
    rounds = rounds_of(records)
    assert rounds == {"cem": 40, "lscm": 7, "fdm": 40}
    by_name = {record.cell.algorithm: record for record in records}
    assert len(paired_ratios(by_name["fdm"], by_name["cem"])) == 40
    assert not is_unstable(by_name["lscm"])
    ended = {name: record.outcome.ended for name, record in by_name.items()}
    assert ended == {"cem": "precise", "lscm": "precise", "fdm": "rounds"}
    assert noting.expected == len(noting.steps) == 3 + 87
    kernels = [r.kernel_seconds for r in by_name["cem"].outcome.rounds]
    assert kernels == [k / 1000 for k in range(1, 41)]
    assert [r.kernel_seconds for r in by_name["lscm"].outcome.rounds] == kernels[:7]


def test_a_reference_is_precise_if_the_ratios_to_it_are(tmp_path):
    speeds = np.random.default_rng(4).lognormal(0, 0.15, 40).repeat(2).tolist()

    class Drifting(Invented):
        def time(self, task, checked):
            return Round(calls=(speeds.pop(),), uv_hash="h")

    tasks = cells(("cem", "fdm"))
    records = run_tasks(tasks, Store(tmp_path), Options(most_rounds=40), None, Drifting)
    assert rounds_of(records) == {"cem": 7, "fdm": 7}
    assert {record.outcome.ended for record in records} == {"precise"}


def test_without_time_each_cell_has_one_round(tmp_path):
    records = run_tasks(cells(), Store(tmp_path), Options(budget=0), None, Invented)
    assert set(rounds_of(records).values()) == {1}
    assert {record.outcome.ended for record in records} == {"budget"}


class Clock:
    """A simulated clock: only checks and timed processes take time."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


#: Seconds of a process: those of the quick profile's algorithms on small and on large surfaces.
SECONDS = {"cem": 0.01, "fdm": 0.05, "ldm": 0.03, "qiem": 0.3}


def timed_by(clock, scatter=0.02, size=lambda task: task.mesh.m / 100):
    class Simulated(Invented):
        def check(self, task):
            clock.now += 1.0 + SECONDS[task.cell.algorithm] * size(task)
            return super().check(task)

        def time(self, task, checked):
            call = SECONDS[task.cell.algorithm] * size(task)
            clock.now += 0.3 + 2.2 * call * float(self.rng.lognormal(0, 0.2))
            seconds = call * float(self.rng.lognormal(0, scatter))
            return Round(calls=(seconds,), uv_hash="h")

    return Simulated


def many_cells(sizes=(100, 200, 300, 400, 500, 700, 900, 1200)):
    chosen = [load_registry().algorithm(name) for name in ("cem", "fdm", "ldm", "qiem")]
    settings = MeasurementSettings.until_precise(0.05)
    meshes = [flat_disk(faces).renamed(f"disk-{faces}") for faces in sizes]
    return plan_cells(chosen, meshes, {}, settings)


@pytest.mark.parametrize(
    ("budget", "scatter", "looked_at"),
    [(60, 0.02, 0), (150, 0.02, 18), (250, 0.02, 28), (450, 0.02, 32), (600, 0.06, 32)],
)
def test_a_run_ends_near_its_budget(tmp_path, monkeypatch, budget, scatter, looked_at):
    clock = Clock()
    monkeypatch.setattr(local, "monotonic", clock)
    began = clock.now
    tasks = many_cells()
    invented = timed_by(clock, scatter)
    records = run_tasks(tasks, Store(tmp_path), Options(budget=budget), None, invented)
    spent = clock.now - began
    print(spent, [len(r.outcome.rounds) for r in records])
    # The checks and one round of each cell take about 95 s, and seven rounds of all 375.
    assert spent <= 1.25 * max(budget, 95)
    early = [r for r in records if r.outcome.ended == "budget"]
    if early:
        assert spent >= 0.75 * budget
    # The dearest have fewer rounds than the first look, and so no interval.
    few = {r.cell.label for r in records if len(r.outcome.rounds) < 7}
    assert all(compare(r, r).interval is None for r in records if r.cell.label in few)
    price = {t.cell.label: SECONDS[t.cell.algorithm] * t.mesh.m for t in tasks}
    cheap = [price[r.cell.label] for r in records if r.cell.label not in few]
    assert len(cheap) >= looked_at
    # A reference alone, however cheap, would be compared with nothing.
    compared = {r.cell.label for r in records if r.cell.algorithm != "cem"}
    if few and cheap:
        assert max(cheap) <= 2 * min(price[label] for label in few & compared)
    # Whoever has rounds has them side by side with the reference.
    rounds = {r.cell.label: len(r.outcome.rounds) for r in records}
    reference = {r.cell.mesh: rounds[r.cell.label] for r in records if r.cell.algorithm == "cem"}
    assert all(rounds[r.cell.label] <= reference[r.cell.mesh] for r in records)


def test_surface_by_surface_more_surfaces_are_complete_in_the_same_time(tmp_path, monkeypatch):
    clock = Clock()
    monkeypatch.setattr(local, "monotonic", clock)
    complete = {}
    for whole in (False, True):
        options = Options(budget=240, whole_surfaces=whole)
        store = Store(tmp_path / str(whole))
        records = run_tasks(many_cells(), store, options, None, timed_by(clock))
        few = {r.cell.mesh for r in records if len(r.outcome.rounds) < 7}
        complete[whole] = {r.cell.mesh for r in records} - few
    assert complete[True] == {f"disk-{faces}" for faces in (100, 200, 300, 400, 500, 700)}
    assert complete[False] < complete[True], complete


def test_a_fixed_number_of_rounds_is_not_cut_by_the_budget(tmp_path):
    chosen = [load_registry().algorithm("cem")]
    tasks = plan_cells(chosen, [flat_disk(100)], {}, MeasurementSettings(repeats=6))
    (record,) = run_tasks(tasks, Store(tmp_path), Options(budget=0), None, Invented)
    assert (len(record.outcome.rounds), record.outcome.ended) == (6, None)


def test_a_run_without_time_that_is_ended_goes_on_to_the_same(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run_tasks(cells(), Store(tmp_path), Options(budget=1e9), Noting(14), Invented)
    records = run_tasks(cells(), Store(tmp_path), Options(budget=0), None, Invented)
    assert sum(rounds_of(records).values()) in (11, 12)
    assert {record.outcome.ended for record in records} == {"budget"}


@pytest.mark.parametrize("end_at", [2, 12, 24, 26, 33])
def test_a_run_that_is_ended_goes_on_and_forgets_nothing(tmp_path, end_at):
    store, options = Store(tmp_path), Options(most_rounds=14)
    with pytest.raises(KeyboardInterrupt):
        run_tasks(cells(), store, options, Noting(end_at), Invented)
    noting = Noting()
    records = run_tasks(cells(), store, options, noting, Invented)
    assert rounds_of(records)["fdm"] == rounds_of(records)["cem"] == 14
    assert len(noting.steps) == 3 + sum(rounds_of(records).values()) - end_at
    again = Noting()
    assert run_tasks(cells(), store, options, again, Invented) == records
    assert not again.steps


def test_a_precision_is_part_of_what_a_cell_is_and_a_fixed_number_is_as_before():
    precise, other = cells()[0].cell, cells(precision=0.1)[0].cell
    chosen = [load_registry().algorithm("cem")]
    fixed = plan_cells(chosen, [flat_disk(100)], {}, MeasurementSettings())[0].cell
    assert len({precise.key, other.key, fixed.key}) == 3
    assert "precision" not in fixed.model_dump()
    assert type(precise).model_validate_json(precise.model_dump_json()) == precise
    with pytest.raises(ValueError, match="either a number of rounds or a precision"):
        fixed.model_copy(update={}).model_validate(fixed.model_dump() | {"precision": 0.1})


def rounds(*seconds):
    return [Round(calls=(s,), sitting="s") for s in seconds]


def test_the_wider_of_both_intervals_counts():
    cell = cells()[0].cell
    steady, shaky = rounds(*[1.0] * 7), rounds(1, 1.1, 0.9, 1.2, 1, 1, 1)
    assert lack(cell, steady) == 0
    assert lack(cell, shaky) == pytest.approx(0.3 / 2 / 0.05)
    assert lack(cell, steady, (cell, shaky)) == pytest.approx((1 / 0.9 - 1 / 1.2) / 2 / 0.05)
    assert lack(cell, rounds(1.0, 1.0)) == inf


def test_the_widest_go_on_first_and_pay_for_their_reference():
    lacks = {"wide": 9.0, "wider": 10.0, "precise": 1.0, "cem": 0.5}
    costs = {"wide": 10.0, "wider": 10.0, "precise": 1.0, "cem": 5.0}
    partners = dict.fromkeys(("wide", "wider", "precise"), "cem")
    chosen = [affordable(lacks, costs, partners, seconds) for seconds in (14, 15, 25, inf)]
    assert chosen[0] == set()
    assert chosen[1] == {"wider", "cem"}
    assert chosen[2] == chosen[3] == {"wide", "wider", "cem"}


def test_a_round_costs_its_calls_and_a_warm_up_that_long_calls_lack():
    assert cost(rounds(2.0)) == 2.0 + 2.0 + BESIDE_CALLS
    assert cost(rounds(20.0)) == 20.0 + BESIDE_CALLS


def test_before_the_first_look_the_cheapest_go_on_with_their_reference():
    costs = {"dear": 20.0, "cheap": 2.0, "middle": 5.0, "cem": 4.0, "alone": 3.0}
    partners = dict.fromkeys(("dear", "cheap", "middle"), "cem")
    chosen = [cheapest(costs, partners, seconds) for seconds in (2, 6.5, 9.5, 15, 34)]
    assert chosen == [
        set(),
        {"alone"},
        {"alone", "cem", "cheap"},
        {"alone", "cem", "cheap", "middle"},
        set(costs),
    ]


def test_no_reference_goes_on_with_which_nothing_is_compared():
    costs = dict.fromkeys(("cem a", "fdm a", "cem b", "fdm b"), 1.0)
    partners = {"fdm a": "cem a", "fdm b": "cem b"}
    chosen = [cheapest(costs, partners, seconds) for seconds in (1, 2, 4)]
    assert chosen == [set(), {"cem a", "fdm a"}, set(costs)]
    assert cheapest(costs, {"fdm a": "cem a"}, 1) == {"cem b"}


def test_surface_by_surface_the_cheapest_surface_is_complete_before_the_next():
    costs = {"cem a": 1.0, "fdm a": 9.0, "cem b": 2.0, "fdm b": 20.0, "ldm b": 3.0}
    partners = {"fdm a": "cem a", "fdm b": "cem b", "ldm b": "cem b"}
    surfaces = {label: label[-1] for label in costs}
    chosen = [cheapest(costs, partners, seconds, surfaces) for seconds in (9, 10, 15, 35)]
    assert chosen[0] == {"cem b", "ldm b"}  # what is left goes to the next surface
    assert chosen[1] == {"cem a", "fdm a"}
    assert chosen[2] == {"cem a", "fdm a", "cem b", "ldm b"}
    assert chosen[3] == set(costs)
    assert "fdm a" not in cheapest(costs, partners, 9.5)  # cell by cell


@pytest.mark.parametrize(("again", "processes"), [(0, 7), (1, 14)])
def test_a_process_beside_which_the_machine_was_busy_is_run_again(
    tmp_path, monkeypatch, again, processes
):
    timed = []
    beside = iter([Neighbours(other_cores=1.0), Neighbours(other_cores=0.0)] * 20)
    monkeypatch.setattr(local, "neighbours", lambda *_: next(beside))
    monkeypatch.setattr(Invented, "time", _noting(Invented.time, timed))
    options = Options(most_rounds=7, repeat_busy=again)
    (record,) = run_tasks(cells(["cem"]), Store(tmp_path), options, None, Invented)
    assert len(timed) == processes
    busy = [r.neighbours.busy for r in record.outcome.rounds]
    assert busy == ([False] * 7 if again else [True, False, True, False, True, False, True])


def _noting(function, calls):
    def noted(*arguments):
        calls.append(arguments)
        return function(*arguments)

    return noted
