"""Run cells on this machine: each process alone, in rounds, so that drift hits all alike.

First every cell is checked: one call in a process of its own, whose map is verified and whose
memory is measured. What ends ok is then timed in rounds. A round has a fresh process for every
cell: surfaces in random order, the cells of a surface one after the other, in random order too, so
a machine that slows down slows all that are compared. A cell has a fixed number of rounds, or is
measured until its intervals are narrow (:mod:`cembench.running.schedule`), as long as time is
left; if it does not suffice for the first look of all cells, the most expensive end early. If
possible the processes are forked from one that has loaded the libraries
(:mod:`cembench.running.fork_server`), one for the checks and another one each round: what differs
from one interpreter to the next (addresses, hash seeds) is the same for all cells of a round, and
averaged over. A round may also have one process that all cells of a surface share
(:mod:`cembench.running.pairing`).
"""

from __future__ import annotations

import tempfile
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any

from cembench.core.arrays import Complex
from cembench.core.errors import RecordError
from cembench.core.notices import Notice, NoticeKind
from cembench.results.comparison import circumstances
from cembench.results.intervals import is_look, next_look
from cembench.results.records import Ended, Outcome, Record, Round
from cembench.results.store import Store
from cembench.running.background_load import counters, neighbours
from cembench.running.environment import describe_environment
from cembench.running.estimate import USUAL_ROUNDS
from cembench.running.map_checks import Checked
from cembench.running.options import Options
from cembench.running.pairing import PROCESSES, WORTH, Scatter
from cembench.running.parallel_checks import check_in_parallel
from cembench.running.plan import Task
from cembench.running.recorder import Recorder, now, record_of, recording
from cembench.running.reference_kernel import kernel_seconds
from cembench.running.schedule import (
    BESIDE_CALLS,
    CellState,
    each_round,
    in_random_order,
    interim_check,
    over_budget,
    scatter_probe,
    sharing_groups,
)
from cembench.running.timing import CellTimer
from cembench.running.timing_checks import is_cold
from cembench.running.watcher import Step, Watcher

#: How many times that of the checked map the E_C of timed maps is at least, to be noted.
WORSE = 1.01


def run_tasks(
    tasks: Sequence[Task],
    store: Store,
    options: Options | None = None,
    watcher: Watcher | None = None,
    timer: Callable[[Path, Options], CellTimer] | None = None,
    *,
    environment: dict[str, Any] | None = None,
) -> list[Record]:
    """Measure the cells that the store does not hold; return records in the tasks' order.

    Each process's result is on disk before the next one starts; where cells share a process, those
    of a surface's round are, together, before the next surface. A second run into the same store
    waits for the first. `timer` makes what checks and times cells, given a folder for its files;
    `environment` is this machine's, where the caller has just described it.
    """
    timer = timer or CellTimer
    with (
        recording(tasks, store, options, watcher, environment) as recorder,
        closing(timer(recorder.scratch, recorder.options)) as cell_timer,
    ):
        _Run(recorder, cell_timer).measure(recorder.pending(tasks))
    return [recorder.records[task.cell.label] for task in tasks]


def map_once(task: Task, options: Options | None = None) -> tuple[Record, Complex | None]:
    """Call once in a process of its own, without warm-up, and keep nothing on disk.

    The map is given if it has the right shape and is finite.

    Raises
    ------
    RecordError
        The temporary folder is full, or cannot be written to.
    """
    started = now()
    try:
        with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
            # One process: loading a server's libraries would be no quicker than loading its own.
            outcome, uv = CellTimer(Path(folder), options or Options(), forks=False).check(task)
    except OSError as error:
        raise RecordError(
            f"the temporary folder cannot be used: {error.strerror or error}. Free some space "
            "there, or set TMPDIR to another folder."
        ) from error
    return record_of(task, outcome, describe_environment()["id"], started), uv


@dataclass
class _Run:
    """One sitting, whose work follows from what the store holds."""

    recorder: Recorder
    timer: CellTimer
    sitting: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    since: float = field(default_factory=lambda: monotonic())
    #: Whether cells that are compared also share a process in each round, and why some do not, by
    #: their circumstances.
    pairs: bool = False
    unpaired: dict[str, str] = field(default_factory=dict)

    @property
    def options(self) -> Options:
        return self.recorder.options

    @property
    def watcher(self) -> Watcher:
        return self.recorder.watcher

    def measure(self, pending: Sequence[Task]) -> None:
        cells = [self._state(task) for task in pending]
        most_rounds = self.options.most_rounds
        self.watcher.begins(sum(state.processes_left(most_rounds) for state in cells))
        self._check_all(cells)
        self._choose_pairing([state for state in cells if state.record is None])
        last = max((state.task.cell.repeats or most_rounds for state in cells), default=0)
        for number in range(last + 1):
            self._end_cells(cells, number)
            timed = [state for state in cells if state.lacks_round(number, most_rounds)]
            if not timed:
                continue
            self.timer.close()
            kernel = kernel_seconds(len(timed))
            ordered = in_random_order(timed, self.options.seed, number)
            for group in sharing_groups(ordered) if self.pairs else [[one] for one in ordered]:
                self._time_group(group, number, kernel)

    def _state(self, task: Task) -> CellState:
        """Return the state of a cell, as far as its journal holds it."""
        samples = self.recorder.store.samples(task.cell, self.recorder.environment["id"])
        return CellState(task, samples, samples.check(), samples.rounds())

    def _check_all(self, cells: Sequence[CellState]) -> None:
        """Check the cells that are not checked yet, one by one or in parallel."""
        new = [state for state in cells if state.check is None]
        for state in cells:
            if state.check is not None:
                self._resume_after_check(state)
        if self.options.jobs < 2 or len(new) < 2:
            self._check_alone(new)
            return
        short = []
        with ExitStack() as stack:
            timers = self.timer.for_checks(self.options.jobs)
            for one in timers:
                stack.callback(one.close)
            for state, (outcome, uv) in check_in_parallel(new, timers, self._checking):
                if outcome.status == "out_of_memory":
                    short.append(state)  # it had a share only
                else:
                    self._save_check(state, outcome, uv)
        self._check_alone(short)

    def _check_alone(self, cells: Sequence[CellState]) -> None:
        """Check one cell after the other, each with all the memory."""
        for state in cells:
            with self._checking(state):
                outcome, uv = self.timer.check(state.task)
            self._save_check(state, outcome, uv)

    def _checking(self, state: CellState) -> AbstractContextManager[None]:
        return self._watched(state.task, self._step(state, None))

    @contextmanager
    def _watched(self, task: Task, step: Step) -> Iterator[None]:
        """Report the start and the end of a process to the watcher."""
        since = monotonic()
        self.watcher.starts(task, step)
        try:
            yield
        finally:
            self.watcher.ends(task, step, monotonic() - since)

    def _save_check(self, state: CellState, outcome: Outcome, uv: Complex | None) -> None:
        state.samples.save_check(outcome, uv)
        state.check = outcome
        self._resume_after_check(state)

    def _resume_after_check(self, state: CellState) -> None:
        if state.passed.status != "ok" or not state.is_timed:
            self._save(state, state.passed.model_copy(update={"rounds": ()}))
        else:
            self._save_if_complete(state)

    def _step(self, state: CellState, number: int | None) -> Step:
        last = state.last_round(number or 0, self.options.most_rounds)
        may_go_on = state.task.cell.precision is not None and last < self.options.most_rounds
        return Step(None if number is None else number + 1, last, may_go_on)

    def _end_cells(self, cells: Sequence[CellState], number: int) -> None:
        """End the cells that are precise, or for which no time is left, before this round."""
        if is_look(number, self.options.most_rounds):
            ended, continued = interim_check(cells, number, self.options, self._seconds_left())
            for state, reason in ended:
                self._save_measured(state, reason)
            more = next_look(number, self.options.most_rounds) - number
            for state in continued:
                self.watcher.adds_rounds(state.task, more)
        elif number:
            for state in over_budget(cells, number, self.options, self._seconds_left()):
                self._save_measured(state, "budget")

    def _seconds_left(self) -> float:
        if self.options.budget is None:
            return inf
        return self.options.budget - (monotonic() - self.since)

    def _choose_pairing(self, cells: Sequence[CellState]) -> None:
        """Decide whether cells that are compared also share a process, and say what it buys.

        The scatter of this machine is measured if that takes a small share of the run: ten
        processes, each with the calls of a cell and of its twin.
        """
        asked = self.options.pairing
        self.pairs = asked == "process"
        probe = scatter_probe(cells, self.options.reference)
        if probe is None or asked == "separate":
            return
        calls = {state.label: state.passed.rounds for state in cells}
        if not all(calls.values()):
            return
        seconds = {label: rounds[0].seconds for label, rounds in calls.items()}
        prices = [BESIDE_CALLS + each_round(one) for one in seconds.values()]
        twins = BESIDE_CALLS + 2 * each_round(seconds[probe.label])
        if PROCESSES * twins > WORTH * min(self._seconds_left(), USUAL_ROUNDS * sum(prices)):
            return
        checked = Checked.of(probe.passed)
        pairs = []
        self.timer.close()
        for _ in range(PROCESSES):
            both = self.timer.together([probe.task, probe.task], [checked, checked])
            if isinstance(both, Outcome):
                return
            pairs.append((both[0].seconds, both[1].seconds))
        scatter = Scatter.of(pairs)
        if asked == "auto":
            self.pairs = scatter.pairing_is_narrower
        self.watcher.shows(scatter.forecast(prices, self._seconds_left(), pairs=self.pairs))

    def _time_group(self, cells: Sequence[CellState], number: int, kernel: float) -> None:
        """Time each cell in a process of its own, and after that all of them in one."""
        rounds = {}
        for state in cells:
            measured = self._time(state, number, kernel)
            if measured is not None:
                rounds[state.label] = measured
        timed = [state for state in cells if state.label in rounds]
        together = self._time_together(timed, number) if len(timed) > 1 else {}
        for state in timed:
            about = {"together": together.get(state.label, ())}
            state.rounds[number] = rounds[state.label].model_copy(update=about)
            state.samples.save_round(number, state.rounds[number])
            self._save_if_complete(state)

    def _time_together(
        self, cells: Sequence[CellState], number: int
    ) -> dict[str, tuple[float, ...]]:
        """Return the calls of these cells in one process; none if these cannot be compared.

        Afterwards the cells have only their own processes, which show which cell is at fault.
        """
        key = circumstances(cells[0].task.cell)
        if key in self.unpaired:
            return {}
        since = monotonic()
        checked = [Checked.of(state.passed) for state in cells]
        rounds = self.timer.together([state.task for state in cells], checked)
        each = (monotonic() - since) / len(cells)
        for state in cells:
            state.seconds[-1] += each
            self.watcher.took(state.task, each)
        if isinstance(rounds, Outcome):
            self.unpaired[key] = f"round {number + 1}: {rounds.cause}"
            return {}
        return {state.label: one.calls for state, one in zip(cells, rounds, strict=True)}

    def _time(self, state: CellState, number: int, kernel: float) -> Round | None:
        """Return the round of a cell's own process; None if it has none, and so its record."""
        step = self._step(state, number)
        started, since = now(), monotonic()
        with self._watched(state.task, step):
            timed = self._timed_when_quiet(state)
        state.seconds.append(monotonic() - since)
        if isinstance(timed, Outcome):
            about: dict[str, Any] = {"cause": f"in {step}: {timed.cause}"}
            if timed.status == "not_comparable":  # the map is valid, and so are its figures
                about |= {"status": timed.status, "faults": timed.faults, "rounds": ()}
                timed = state.passed
            self._save(state, timed.model_copy(update=about))
            return None
        origin = {"sitting": self.sitting, "started_at": started, "kernel_seconds": kernel}
        return timed.model_copy(update=origin)

    def _timed_when_quiet(self, state: CellState) -> Round | Outcome:
        """Time one process; repeat it if the machine was busy, up to the requested number of times.

        The run with the least activity of other programs counts; the seconds never decide.
        """
        checked = Checked.of(state.passed)
        best: Round | None = None
        for _ in range(1 + self.options.repeat_busy):
            before = counters()
            timed = self.timer.time(state.task, checked)
            if isinstance(timed, Outcome):
                return timed
            beside = neighbours(before, counters(), state.task.cell.threads)
            timed = timed.model_copy(update={"neighbours": beside})
            if best is None or _disturbed(timed) < _disturbed(best):
                best = timed
            if not beside.busy:
                break
        assert best is not None
        return best

    def _save_if_complete(self, state: CellState) -> None:
        if state.task.cell.repeats and len(state.rounds) >= state.task.cell.repeats:
            self._save_measured(state, None)

    def _save_measured(self, state: CellState, ended: Ended | None) -> None:
        rounds = tuple(state.rounds[number] for number in sorted(state.rounds))
        outcome = state.passed.model_copy(update={"rounds": rounds, "ended": ended})
        notes = (*outcome.notes, *_notes(outcome))
        why = self.unpaired.get(circumstances(state.task.cell))
        if why is not None:
            text = f"not compared within one process, which could not be used in {why}"
            notes = (*notes, Notice(NoticeKind.NOT_TOGETHER, text))
        self._save(state, outcome.model_copy(update={"notes": notes}))

    def _save(self, state: CellState, outcome: Outcome) -> None:
        started = outcome.rounds[0].started_at if outcome.rounds else now()
        environment = self.recorder.environment["id"]
        state.record = record_of(state.task, outcome, environment, started)
        self.recorder.save(state.task, state.record, state.samples.uv())


def _notes(outcome: Outcome) -> tuple[Notice, ...]:
    """Return remarks on what the rounds of a cell show together."""
    rounds, notices = outcome.rounds, []
    if outcome.worse_when_timed > WORSE:
        text = (
            f"E_C of the timed maps is {outcome.worse_when_timed:.3g} times that of the map shown: "
            "the seconds belong to worse maps, of surfaces that are moved and renumbered"
        )
        notices.append(Notice(NoticeKind.WORSE_WHEN_TIMED, text))
    differing = [k for k, r in enumerate(rounds, start=1) if r.repeated is False]
    if differing:
        named = ", ".join(map(str, differing))
        text = f"not deterministic: the same surface got different maps in rounds {named}"
        if any(r.differs for r in rounds):
            text += ", by more than their position, so it is not called faster than another"
        notices.append(Notice(NoticeKind.NOT_DETERMINISTIC, text))
    cold = is_cold(rounds)
    if cold is not None:
        text = (
            f"the first call of a process takes {cold[0]:.3g} s, later ones {cold[1]:.3g} s: the "
            "seconds are those of later calls, which may use what the first one kept"
        )
        notices.append(Notice(NoticeKind.COLD_FIRST_CALL, text))
    return tuple(notices)


def _disturbed(measured: Round) -> float:
    beside = measured.neighbours
    return 0.0 if beside is None else beside.other_cores + beside.stolen_cores
