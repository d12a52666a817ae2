"""Run cells on this machine: each process alone, in rounds, so that drift hits all alike.

First every cell is checked: one call in a process of its own, whose map is verified and whose
memory is measured. What ends ok is then timed in rounds. A round has a fresh process for every
cell: surfaces in random order, the cells of a surface one after the other, in random order too, so
a machine that slows down slows all that are compared. A cell has a fixed number of rounds, or is
measured until its intervals are narrow (:mod:`cembench.running.until_precise`), as long as time is
left; where that does not last for the first look of all, the dearest end early. Where that is
possible the processes are forked from one that has loaded the libraries
(:mod:`cembench.running.fork_server`), one for the checks and another one each round: what differs
from one interpreter to the next (addresses, hash seeds) is the same for all cells of a round, and
averaged over. A round may also have one process that all cells of a surface share
(:mod:`cembench.running.pairing`).
"""

from __future__ import annotations

import atexit
import os
import random
import shutil
import sys
import tempfile
import threading
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from math import inf, isinf
from pathlib import Path
from statistics import median
from time import monotonic
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from cembench.core.errors import RecordError
from cembench.core.names import file_name
from cembench.core.notices import Notice, NoticeKind
from cembench.linear_algebra.backends import default_backend
from cembench.results.comparison import circumstances
from cembench.results.looks import USUAL_MOST_ROUNDS, is_look, next_look
from cembench.results.record_rows import REFERENCE
from cembench.results.records import (
    Ended,
    Fault,
    FaultKind,
    Outcome,
    Record,
    Round,
    Status,
    not_ok,
)
from cembench.results.samples import Samples
from cembench.results.store import Store
from cembench.running.comparable import impossible, incomparable, is_cold
from cembench.running.environment import describe_environment, for_measuring
from cembench.running.estimate import USUAL_ROUNDS, expected_bytes
from cembench.running.external.present import external_of
from cembench.running.fork_server import ForkServer, ServerGoneError, can_fork
from cembench.running.judge import Promise
from cembench.running.judging import (
    SAME_MAP,
    Checked,
    JudgedCalls,
    difference,
    kept_from_call_to_call,
    sample,
)
from cembench.running.kernel import kernel_seconds
from cembench.running.measure import (
    ENOUGH_CALLS,
    LONG_CALL,
    SECOND_CALL,
    WARM_UP,
)
from cembench.running.motion import NUMBERS_KEPT, UNMOVED, in_first_order
from cembench.running.neighbours import counters, neighbours
from cembench.running.pairing import PROCESSES, WORTH, Pairing, Scatter
from cembench.running.plan import Task
from cembench.running.process import Limits, ProcessEnd, finds_all, run_limited, spawning
from cembench.running.side_by_side import check_side_by_side
from cembench.running.until_precise import (
    BESIDE_CALLS,
    affordable,
    cheapest,
    cost,
    each_round,
    lack,
)
from cembench.running.worker import PROGRAMS, Answer, Job, JobTask, Part, TimedPart

#: Wall-clock seconds that a call may take unless the user says otherwise.
DEFAULT_TIMEOUT = 600.0
#: Wall-clock seconds that judging a map may take at least.
JUDGE_SECONDS = 600.0
#: Seconds after which no cell goes on, unless the user says otherwise.
USUAL_BUDGET = 1800.0
#: By what share of the budget a plan may exceed it later than after the first round: prices
#: scatter, and a cell that is left out cannot come back.
_TOLERATED = 0.1
#: Number of new processes that are asked, at most, how far maps of a randomised solver scatter.
_MOST_ASKED = 3
#: The largest answer that is read: what a worker keeps takes a few megabytes at most.
LARGEST_ANSWER_BYTES = 2**24


@dataclass(frozen=True)
class Options:
    """Options of a run."""

    #: A process that times has twice as long, because it makes at least two calls.
    timeout: float = DEFAULT_TIMEOUT
    #: Resident bytes of a process and all that it starts; None: no limit.
    memory_bytes: int | None = None
    #: Measure again the cells that the store holds.
    fresh: bool = False
    #: Measure again the cells that the store holds and that did not end ok.
    rerun_failed: bool = False
    #: Seed of the random order within each round.
    seed: int = 0
    #: The algorithm that the others are compared with: their ratios to it become precise.
    reference: str = REFERENCE
    #: Rounds of a cell that is measured until it is precise, at most.
    most_rounds: int = USUAL_MOST_ROUNDS
    #: Wall-clock seconds after which no cell goes on that has had a round; None: no limit.
    #: Cells with a fixed number of rounds have all of them.
    budget: float | None = None
    #: Whether a budget that does not bring all cells to their first look is spent surface by
    #: surface, so that the comparisons on the cheapest ones are complete; else cell by cell.
    whole_surfaces: bool = False
    #: Whether the cells that are compared on a surface also share a process in each round:
    #: "process", "separate", or "auto": where that promises narrower ratios in the same time.
    pairing: Pairing = "separate"
    #: How often a process is repeated if the machine was busy; the quietest run counts.
    repeat_busy: int = 0
    #: Number of checks that run in parallel, sharing the memory. Timed processes run alone.
    jobs: int = 1

    def measures_again(self, kept: Record) -> bool:
        """Whether a cell with this record is measured again."""
        return self.fresh or (self.rerun_failed and kept.outcome.status != "ok")


@dataclass(frozen=True)
class Step:
    """One process of a cell: its check, or one of its rounds, counted from 1."""

    #: None: the check.
    round: int | None = None
    #: How many there are, or those up to the next look, after which there may be more.
    rounds: int = 0
    may_go_on: bool = False

    def __str__(self) -> str:
        if self.round is None:
            return "check"
        return f"round {self.round} of {'at least ' if self.may_go_on else ''}{self.rounds}"


class Watcher:
    """Receives the progress of a run; a subclass shows it."""

    def waits(self) -> None:
        """Another run is writing to the folder; this one continues when that one has ended."""

    def begins(self, processes: int) -> None:
        """The run starts; `processes` processes will be started."""

    def timing_starts(self) -> None:
        """All checks have ended; the following processes are timed."""

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """A cell is not precise yet; `rounds` more rounds follow."""

    def starts(self, task: Task, step: Step) -> None:
        """A process starts."""

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """A process has ended, after `seconds` in all."""

    def took(self, task: Task, seconds: float) -> None:
        """A cell's part of a process that it shared took `seconds` more."""

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """A cell has its record, from an earlier run if `kept`; it needs no more processes."""

    def machines(self, names: Sequence[str]) -> None:
        """These machines of a cluster take part now, one name per worker."""

    def says(self, words: str) -> None:
        """Before the first round: what precision this machine and the budget allow."""

    def shows(self, words: str) -> None:
        """Something happened to a machine of the cluster, or to a unit that it measured."""


def run_tasks(
    tasks: Sequence[Task],
    store: Store,
    options: Options | None = None,
    watcher: Watcher | None = None,
    launcher: Callable[[Path, Options], Launcher] | None = None,
    *,
    environment: dict[str, Any] | None = None,
) -> list[Record]:
    """Measure the cells that the store does not hold; return records in the tasks' order.

    Each process's result is on disk before the next one starts; where cells share a process, those
    of a surface's round are, together, before the next surface. A second run into the same store
    waits for the first. `launcher` makes what starts the processes, given a folder for its files;
    `environment` is this machine's, where the caller has just described it.
    """
    options, watcher = options or Options(), watcher or Watcher()
    launcher = launcher or Launcher
    with store.locked(watcher.waits) as scratch, closing(launcher(scratch, options)) as starting:
        store.save_plan([task.cell for task in tasks])
        for mesh in {task.cell.mesh_hash: task.mesh for task in tasks}.values():
            store.save_mesh(mesh)
        run = _Run(store, starting, options, watcher, environment or describe_environment())
        run.measure(tasks)
    return [run.records[task.cell.label] for task in tasks]


def map_once(
    task: Task, options: Options | None = None
) -> tuple[Record, NDArray[np.complex128] | None]:
    """Call once in a process of its own, without warm-up, and keep nothing on disk.

    The map is given if it has the right shape and is finite.

    Raises
    ------
    RecordError
        The temporary folder is full, or cannot be written to.

    """
    started = _now()
    try:
        with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
            # One process: loading a server's libraries would be no quicker than loading its own.
            outcome, uv = Launcher(Path(folder), options or Options(), forks=False).check(task)
    except OSError as error:
        raise RecordError(
            f"the temporary folder cannot be used: {error.strerror or error}. Free some space "
            "there, or set TMPDIR to another folder."
        ) from error
    return record_of(task, outcome, describe_environment()["id"], started), uv


def in_random_order(tasks: Sequence[Task], seed: int, number: int) -> list[Task]:
    """Return the order of a round, which depends only on the seed and the round.

    The surfaces come in random order, and for each surface its cells: these are compared with each
    other, so little time should pass between them.
    """
    chance = random.Random(f"{seed} {number}")
    of_surface: dict[str, list[Task]] = {}
    for task in tasks:
        of_surface.setdefault(task.cell.mesh_hash, []).append(task)
    blocks = chance.sample(list(of_surface.values()), len(of_surface))
    return [task for block in blocks for task in chance.sample(block, len(block))]


def kept_record(
    task: Task, store: Store, options: Options, asked: AbstractSet[str]
) -> Record | None:
    """Return the valid record, if any; delete the samples of a cell that is measured again.

    A record follows its mesh to another name, unless the old one is `asked` for too.
    """
    kept = store.find(task.cell)
    if kept is not None or options.fresh:
        store.forget_samples(task.cell)
    if kept is None or options.measures_again(kept):
        return None
    if kept.cell.label != task.cell.label:
        return store.rename(kept, task.cell, keep=kept.cell.label in asked)
    return kept


@dataclass
class _Run:
    """One sitting, whose work follows from what the store holds."""

    store: Store
    launcher: Launcher
    options: Options
    watcher: Watcher
    environment: dict[str, Any]
    sitting: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    records: dict[str, Record] = field(default_factory=dict)
    since: float = field(default_factory=lambda: monotonic())
    #: What the journals hold, by the cells' labels.
    checks: dict[str, Outcome] = field(default_factory=dict)
    rounds: dict[str, dict[int, Round]] = field(default_factory=dict)
    #: Seconds of the processes that were timed in this sitting, by the cells' labels.
    took: dict[str, list[float]] = field(default_factory=dict)
    #: Whether cells that are compared also share a process in each round, and why some do not, by
    #: their circumstances.
    pairs: bool = False
    apart: dict[str, str] = field(default_factory=dict)

    def measure(self, tasks: Sequence[Task]) -> None:
        asked = {task.cell.label for task in tasks}
        pending = [task for task in tasks if not self._is_kept(task, asked)]
        for task in pending:
            self._load(task)
        self.watcher.begins(sum(self._processes_left(task) for task in pending))
        self._check_all(pending)
        self.watcher.timing_starts()
        self._choose_pairing([task for task in pending if task.cell.label not in self.records])
        most = max((task.cell.repeats or self.options.most_rounds for task in pending), default=0)
        for number in range(most + 1):
            if is_look(number, self.options.most_rounds):
                self._look(pending, number)
            elif number:
                self._keep_to_budget(pending, number)
            open_ = [task for task in pending if self._lacks(task, number)]
            if not open_:
                continue
            self.launcher.close()
            kernel = kernel_seconds(len(open_))
            for group in self._groups(in_random_order(open_, self.options.seed, number)):
                self._time_group(group, number, kernel)

    def _is_kept(self, task: Task, asked: AbstractSet[str]) -> bool:
        kept = kept_record(task, self.store, self.options, asked)
        if kept is not None:
            self._finish(task, kept, kept=True)
        return kept is not None

    def _load(self, task: Task) -> None:
        samples = self._samples(task)
        checked = samples.check()
        if checked is not None:
            self.checks[task.cell.label] = checked
        self.rounds[task.cell.label] = samples.rounds()

    def _processes_left(self, task: Task) -> int:
        done = len(self.rounds[task.cell.label])
        return (task.cell.label not in self.checks) + max(0, self._last(task, done) - done)

    def _last(self, task: Task, done: int) -> int:
        """Return the round after which a cell ends, or after which its interval is checked."""
        return task.cell.repeats or next_look(done, self.options.most_rounds)

    def _check_all(self, pending: Sequence[Task]) -> None:
        """Check the cells that are not checked yet, one by one or in parallel."""
        new = [task for task in pending if task.cell.label not in self.checks]
        for task in pending:
            if task.cell.label in self.checks:
                self._resume_after_check(task)
        if self.options.jobs < 2 or len(new) < 2:
            self._check_alone(new)
            return
        short = []
        with ExitStack() as stack:
            launchers = self.launcher.for_checks(self.options.jobs)
            for launcher in launchers:
                stack.callback(launcher.close)
            for task, (outcome, uv), launcher in check_side_by_side(new, launchers, self._checking):
                if outcome.status == "out_of_memory":
                    short.append(task)  # it had a share only
                    continue
                self.launcher.take_over(launcher, task)
                self._keep_check(task, outcome, uv)
        self._check_alone(short)

    def _check_alone(self, tasks: Sequence[Task]) -> None:
        """Check one cell after the other, each with all the memory."""
        for task in tasks:
            with self._checking(task):
                outcome, uv = self.launcher.check(task)
            self._keep_check(task, outcome, uv)

    def _checking(self, task: Task) -> _Process:
        return _Process(self.watcher, task, self._step(task, None))

    def _keep_check(self, task: Task, outcome: Outcome, uv: NDArray[np.complex128] | None) -> None:
        self._samples(task).save_check(outcome, uv)
        self.checks[task.cell.label] = outcome
        self._resume_after_check(task)

    def _resume_after_check(self, task: Task) -> None:
        outcome = self.checks[task.cell.label]
        if outcome.status != "ok":
            self._save(task, outcome.model_copy(update={"rounds": ()}))
        else:
            self._save_if_complete(task)

    def _step(self, task: Task, number: int | None) -> Step:
        last = self._last(task, number or 0)
        may_go_on = task.cell.precision is not None and last < self.options.most_rounds
        return Step(None if number is None else number + 1, last, may_go_on)

    def _lacks(self, task: Task, number: int) -> bool:
        return (
            task.cell.label not in self.records
            and number < (task.cell.repeats or self.options.most_rounds)
            and number not in self.rounds[task.cell.label]
        )

    def _look(self, pending: Sequence[Task], number: int) -> None:
        """End the cells that are precise or cannot continue; references end last.

        A cell that has more rounds, from before a kill, went on when this was asked before.
        """
        last = number >= self.options.most_rounds
        open_ = {
            label: task
            for label, task in self._until_precise(pending).items()
            if last or len(self.rounds[label]) == number
        }
        partners = _partners(open_.values(), self.options.reference)
        rounds = {label: list(self.rounds[label].values()) for label in open_}
        lacks = {}
        for label, task in open_.items():
            partner = partners.get(label)
            beside = (open_[partner].cell, rounds[partner]) if partner else None
            lacks[label] = lack(task.cell, rounds[label], beside)
        more = next_look(number, self.options.most_rounds) - number
        costs = {label: more * self._price(label) for label in open_}
        go_on = set() if last else affordable(lacks, costs, partners, self._seconds_left())
        for label in sorted(open_.keys() - go_on, key=lambda label: label in partners.values()):
            ended: Ended = "rounds" if last else "budget"
            self._save_measured(open_[label], "precise" if lacks[label] <= 1 else ended)
        for label in go_on:
            self.watcher.adds_rounds(open_[label], more)

    def _keep_to_budget(self, pending: Sequence[Task], number: int) -> None:
        """End the cells that the budget does not bring to their first look, the dearest first."""
        left = self._seconds_left()
        if isinf(left) or number >= next_look(0, self.options.most_rounds):
            return
        open_ = {
            label: task
            for label, task in self._until_precise(pending).items()
            if len(self.rounds[label]) == number
        }
        partners = _partners(open_.values(), self.options.reference)
        more = next_look(number, self.options.most_rounds) - number
        costs = {label: more * self._price(label) for label in open_}
        if number > 1:
            left += _TOLERATED * (self.options.budget or 0.0)
        if sum(costs.values()) <= left:
            return
        surfaces = {label: task.cell.mesh_hash for label, task in open_.items()}
        chosen = cheapest(costs, partners, left, surfaces if self.options.whole_surfaces else None)
        for label in sorted(open_.keys() - chosen):
            self._save_measured(open_[label], "budget")

    def _until_precise(self, pending: Sequence[Task]) -> dict[str, Task]:
        """Return the unfinished cells without a fixed number of rounds, by label."""
        return {
            task.cell.label: task
            for task in pending
            if task.cell.label not in self.records and task.cell.precision is not None
        }

    def _price(self, label: str) -> float:
        """Return the expected seconds of another round of a cell.

        Its first process in a sitting makes one call more than the others, and does not count.
        """
        took = self.took.get(label, [])[1:]
        return median(took) if took else cost(list(self.rounds[label].values()))

    def _seconds_left(self) -> float:
        if self.options.budget is None:
            return inf
        return self.options.budget - (monotonic() - self.since)

    def _choose_pairing(self, tasks: Sequence[Task]) -> None:
        """Decide whether cells that are compared also share a process, and say what it buys.

        The scatter of this machine is measured if that takes a small share of the run: ten
        processes, each with the calls of a cell and of its twin.
        """
        asked = self.options.pairing
        self.pairs = asked == "process"
        chosen = _known_call(tasks, self.options.reference)
        if chosen is None or asked == "separate":
            return
        calls = [self.checks[task.cell.label].rounds for task in tasks]
        known = [rounds[0].seconds for rounds in calls if rounds]
        prices = [BESIDE_CALLS + each_round(seconds) for seconds in known]
        twins = BESIDE_CALLS + 2 * each_round(known[tasks.index(chosen)]) if all(calls) else inf
        if PROCESSES * twins > WORTH * min(self._seconds_left(), USUAL_ROUNDS * sum(prices)):
            return
        checked = Checked.of(self.checks[chosen.cell.label])
        found = []
        self.launcher.close()
        for _ in range(PROCESSES):
            both = self.launcher.together([chosen, chosen], [checked, checked])
            if isinstance(both, Outcome):
                return
            found.append((both[0].seconds, both[1].seconds))
        scatter = Scatter.of(found)
        if asked == "auto":
            self.pairs = scatter.pairing_is_narrower
        self.watcher.says(scatter.words(prices, self._seconds_left(), pairs=self.pairs))

    def _groups(self, tasks: Sequence[Task]) -> list[list[Task]]:
        """Return the cells that are compared with each other, and so may share a process."""
        if not self.pairs:
            return [[task] for task in tasks]
        groups: dict[str, list[Task]] = {}
        for task in tasks:
            alone = task.algorithm.program is not None
            key = task.cell.label if alone else circumstances(task.cell)
            groups.setdefault(key, []).append(task)
        return list(groups.values())

    def _time_group(self, tasks: Sequence[Task], number: int, kernel: float) -> None:
        """Time each cell in a process of its own, and after that all of them in one."""
        measured = [(task, self._time(task, number, kernel)) for task in tasks]
        rounds = {task.cell.label: found for task, found in measured if found is not None}
        timed = [task for task in tasks if task.cell.label in rounds]
        together = self._time_together(timed, number) if len(timed) > 1 else {}
        for task in timed:
            label = task.cell.label
            found = rounds[label].model_copy(update={"together": together.get(label, ())})
            self._samples(task).save_round(number, found)
            self.rounds[label][number] = found
            self._save_if_complete(task)

    def _time_together(self, tasks: Sequence[Task], number: int) -> dict[str, tuple[float, ...]]:
        """Return the calls of these cells in one process; none if these cannot be compared.

        Then the cells go on in processes of their own alone, which show whose fault it is.
        """
        key = circumstances(tasks[0].cell)
        if key in self.apart:
            return {}
        since = monotonic()
        checked = [Checked.of(self.checks[task.cell.label]) for task in tasks]
        found = self.launcher.together(tasks, checked)
        each = (monotonic() - since) / len(tasks)
        for task in tasks:
            self.took[task.cell.label][-1] += each
            self.watcher.took(task, each)
        if isinstance(found, Outcome):
            self.apart[key] = f"round {number + 1}: {found.cause}"
            return {}
        return {task.cell.label: one.calls for task, one in zip(tasks, found, strict=True)}

    def _time(self, task: Task, number: int, kernel: float) -> Round | None:
        """Return the round of a cell's own process; None if it has none, and so its record."""
        step = self._step(task, number)
        started = _now()
        checked = self.checks[task.cell.label]
        with _Process(self.watcher, task, step) as process:
            found = self._timed_when_quiet(task, Checked.of(checked))
        self.took.setdefault(task.cell.label, []).append(monotonic() - process.since)
        if isinstance(found, Outcome):
            more: dict[str, Any] = {"cause": f"in {step}: {found.cause}"}
            if found.status == "not_comparable":  # the map is valid, and so are its figures
                more |= {"status": found.status, "faults": found.faults, "rounds": ()}
                found = checked
            self._save(task, found.model_copy(update=more))
            return None
        origin = {"sitting": self.sitting, "started_at": started, "kernel_seconds": kernel}
        return found.model_copy(update=origin)

    def _timed_when_quiet(self, task: Task, checked: Checked) -> Round | Outcome:
        """Time one process; repeat it if the machine was busy, up to the requested number of times.

        The run with the least activity of other programs counts; the seconds never decide.
        """
        best: Round | None = None
        for _ in range(1 + self.options.repeat_busy):
            before = counters()
            found = self.launcher.time(task, checked)
            if isinstance(found, Outcome):
                return found
            beside = neighbours(before, counters(), task.cell.threads)
            found = found.model_copy(update={"neighbours": beside})
            if best is None or _disturbed(found) < _disturbed(best):
                best = found
            if not beside.busy:
                break
        assert best is not None
        return best

    def _save_if_complete(self, task: Task) -> None:
        if task.cell.repeats and len(self.rounds[task.cell.label]) >= task.cell.repeats:
            self._save_measured(task, None)

    def _save_measured(self, task: Task, ended: Ended | None) -> None:
        checked = self.checks[task.cell.label]
        rounds = tuple(
            self.rounds[task.cell.label][k] for k in sorted(self.rounds[task.cell.label])
        )
        notes = (*checked.notes, *_notes(checked, rounds))
        why = self.apart.get(circumstances(task.cell))
        if why is not None:
            text = f"not compared within one process, which could not be used in {why}"
            notes = (*notes, Notice(NoticeKind.NOT_TOGETHER, text))
        told = {"rounds": rounds, "notes": notes, "ended": ended}
        self._save(task, checked.model_copy(update=told))

    def _save(self, task: Task, outcome: Outcome) -> None:
        started = outcome.rounds[0].started_at if outcome.rounds else _now()
        record = record_of(task, outcome, self.environment["id"], started)
        self.store.save(record, self._samples(task).uv(), self.environment)
        self._finish(task, record, kept=False)

    def _finish(self, task: Task, record: Record, *, kept: bool) -> None:
        self.records[task.cell.label] = record
        self.watcher.finished(task, record, kept=kept)

    def _samples(self, task: Task) -> Samples:
        return self.store.samples(task.cell, self.environment["id"])


def _partners(tasks: Iterable[Task], reference: str) -> dict[str, str]:
    """Return the cell of the reference that each other cell is compared with, by label."""
    known = {
        circumstances(task.cell): task.cell.label
        for task in tasks
        if task.cell.algorithm == reference
    }
    return {
        task.cell.label: known[circumstances(task.cell)]
        for task in tasks
        if circumstances(task.cell) in known and task.cell.algorithm != reference
    }


def _known_call(tasks: Sequence[Task], reference: str) -> Task | None:
    """Return the cheapest cell whose calls show how a machine scatters; None if there is none.

    That is one of the reference on the smallest surface, where cells are measured until precise.
    """
    calls = [
        task
        for task in tasks
        if task.cell.algorithm == reference
        and task.cell.precision is not None
        and task.algorithm.program is None
    ]
    return min(calls, key=lambda task: task.mesh.m, default=None)


def _disturbed(measured: Round) -> float:
    beside = measured.neighbours
    return 0.0 if beside is None else beside.other_cores + beside.stolen_cores


@dataclass
class _Process:
    """Reports the start and the end of a process to the watcher."""

    watcher: Watcher
    task: Task
    step: Step
    since: float = field(default_factory=lambda: monotonic())

    def __enter__(self) -> Self:
        self.watcher.starts(self.task, self.step)
        return self

    def __exit__(self, *_: object) -> None:
        self.watcher.ends(self.task, self.step, monotonic() - self.since)


def _notes(checked: Outcome, rounds: Sequence[Round]) -> tuple[Notice, ...]:
    told = []
    differing = [
        k + 1
        for k, r in enumerate(rounds)
        if r.repeated is False
        or (r.uv_hash is not None and r.uv_hash != checked.uv_hash)
        or not all(r.same_bits)
    ]
    if differing:
        named = ", ".join(map(str, differing))
        text = f"not deterministic: the same surface got different maps in rounds {named}"
        told.append(Notice(NoticeKind.NOT_DETERMINISTIC, text))
    cold = is_cold(rounds)
    if cold is not None:
        text = (
            f"the first call of a process takes {cold[0]:.3g} s, later ones {cold[1]:.3g} s: the "
            "seconds are those of later calls, which may use what the first one kept"
        )
        told.append(Notice(NoticeKind.COLD_FIRST_CALL, text))
    return tuple(told)


def record_of(task: Task, outcome: Outcome, environment: str, started: str) -> Record:
    """Return the record of a cell with this outcome."""
    return Record(
        cell=task.cell,
        title=task.algorithm.title,
        target=task.algorithm.target,
        mesh=task.facts,
        outcome=outcome,
        environment=environment,
        started_at=started,
        sources=dict(task.sources),
        external=external_of(task.algorithm),
    )


@dataclass
class Launcher:
    """Starts the processes; `scratch` is the folder for exchanging files with them.

    They are forked from a server where `forks` allows it and the system can. It stands until
    :meth:`close`; the next process gets a new one.
    """

    scratch: Path
    options: Options
    forks: bool = True
    _server: ForkServer | None = None
    #: Status of the mesh files when they were written.
    _written: dict[Path, tuple[int, ...]] = field(default_factory=dict)
    #: Drawn at the start, so that no result can have been stored for these motions.
    _drawn: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    #: How often each cell was timed.
    _times: Counter[str] = field(default_factory=Counter)
    #: For each cell, a call of its last process: its motion and a sample of its map.
    _last: dict[str, tuple[str, Path]] = field(default_factory=dict)
    #: Seconds of the first call of each cell's last process.
    _first_seconds: dict[str, float] = field(default_factory=dict)
    #: The largest difference between maps of the same surface by two new processes.
    _scatter: dict[str, float] = field(default_factory=dict)
    #: Number of the server that forks the judges; no two launchers share one.
    number: int = 0
    _stopped: threading.Event = field(default_factory=threading.Event)

    def for_checks(self, jobs: int) -> list[Self]:
        """Return `count` launchers like this one, which may check at the same time.

        Called in the thread in which the program ends: servers end with the thread that made them.
        """
        share = self.options.memory_bytes and self.options.memory_bytes // jobs
        options = replace(self.options, memory_bytes=share)
        for number in range(1, jobs + 1):
            _judges(number)
        return [
            type(self)(self.scratch / f"checks-{number}", options, self.forks, number=number)
            for number in range(1, jobs + 1)
        ]

    def take_over(self, other: Self, task: Task) -> None:
        """Take over what another launcher knows about the check of a task."""
        label = task.cell.label
        if label in other._last:
            self._last[label] = other._last[label]
            self._first_seconds[label] = other._first_seconds[label]

    def stop(self) -> None:
        """End the running process, and every later one right after its start."""
        self._stopped.set()

    def close(self) -> None:
        """End the server, if there is one."""
        if self._server is not None:
            self._server.close()
            self._server = None

    def check(self, task: Task) -> tuple[Outcome, NDArray[np.complex128] | None]:
        """Return the outcome of one call, and its map if it is finite and of the right shape.

        A large surface that needs more than the memory limit by estimate is not tried.
        """
        limit = self.options.memory_bytes
        expected = expected_bytes(task.cell.algorithm, task.mesh.m)
        if limit is not None and expected is not None and expected > limit:
            return not_ok("out_of_memory", _too_large(task.mesh.m, expected, limit)), None
        answer = self._run(task, "check", self.options.timeout)
        if answer.outcome is None:
            return _unreadable("it holds no outcome"), None
        try:
            uv = _read_uv(self.scratch / "uv.npy", task)
        except (OSError, ValueError, EOFError) as error:
            return _unreadable(f"its map: {error}"), None
        if uv is None:
            return answer.outcome, None
        judged = self._judged(task, "judge check", called=answer.outcome)
        if judged.outcome is None:
            return _unreadable("its map could not be judged"), None
        self._keep(task, UNMOVED, uv)
        self._first_seconds[task.cell.label] = max(answer.outcome.seconds, default=0.0)
        return judged.outcome, uv

    def time(self, task: Task, checked: Checked) -> Round | Outcome:
        """Return the timed calls of one process, or the outcome if it has none."""
        found = self.together([task], [checked])
        return found if isinstance(found, Outcome) else found[0]

    def together(self, tasks: Sequence[Task], checked: Sequence[Checked]) -> list[Round] | Outcome:
        """Return the timed calls of these cells in one process, or the outcome if a cell has none.

        Each cell has calls, motions and judgements as in a process of its own. Which cell it was
        that used more than it may is not known where there are several.
        """
        parts = [self._part(number, task) for number, task in enumerate(tasks)]
        began = monotonic()
        answer = self._run(tasks[0], "time", 2 * len(tasks) * self.options.timeout, parts=parts)
        ended = monotonic()
        used = answer.used
        if used is None or len(answer.parts) != len(parts):
            return answer.outcome or _unreadable("it holds no round")
        for part, told in zip(parts, answer.parts, strict=True):
            if not set(told.motions) <= set(part.motions) or len(told.names) != len(told.motions):
                return _unreadable("it reports other calls than those requested")
        rounds = [told.round for told in answer.parts]
        used.wall = sum(sum(one.calls) for one in rounds)
        used.cold = sum(one.cold_seconds or 0.0 for one in rounds)
        for task, one in zip(tasks, rounds, strict=True):
            self._first_seconds[task.cell.label] = one.cold_seconds or one.calls[0]
        wrong = [fault for one in rounds for fault in impossible(used, one, began, ended)]
        wrong = wrong or incomparable(used, answer.running, tasks[0].cell.threads)
        if wrong:
            return not_ok("not_comparable", *wrong)
        found = []
        for task, known, part, told in zip(tasks, checked, parts, answer.parts, strict=True):
            part.uv_file.replace(self.scratch / "uv.npy")
            judged = self._judged_calls(task, known, told)
            if isinstance(judged, Outcome):
                return judged
            more = {"motions": part.turn, "repeated": judged.repeated}
            found.append(told.round.model_copy(update=more))
        return found

    def _part(self, number: int, task: Task) -> Part:
        """Return what the next process of a cell makes, alone or with others.

        Its surfaces are moved and renumbered, for all cells alike. Where calls are short, the
        first one, which only warms up, gets a motion that a call of the process before has had: so
        what a fresh process makes of it is compared with what one did that had been called before.
        A cell's first process makes another call that is not timed, whose surface keeps its
        numbers: what is kept by the triangles shows in its map.
        """
        label = task.cell.label
        is_first = not self._times[label]
        turn = f"{self.options.seed} {self._drawn} {self._times[label]}"
        self._times[label] += 1
        ending = NUMBERS_KEPT if task.algorithm.target == "atlas" else ""
        motions = [f"{turn} {k}{ending}" for k in range(ENOUGH_CALLS + 2)]
        if is_first:
            motions[1] = f"{turn} 1{NUMBERS_KEPT}"
        last = self._last.get(label)
        replays = last is not None and not self._is_long(task)
        if last is not None and replays:
            motions[0] = last[0]
        return Part(
            cell=task.cell,
            plugins=task.plugins,
            turn=turn,
            motions=tuple(motions),
            first_counts=not replays,
            untimed=1 + is_first,
            uv_file=self.scratch / f"uv-{number}.npy",
        )

    def _judged_calls(self, task: Task, checked: Checked, told: TimedPart) -> JudgedCalls | Outcome:
        """Return the notices on the maps of a process, or an outcome if they are faulty."""
        label = task.cell.label
        known = dict([self._last[label]]) if label in self._last else {}
        judged = self._judge_once(task, checked, told, known)
        if isinstance(judged, JudgedCalls) and judged.doubtful is not None and not judged.faults:
            # For this surface or method, rounding decides between several maps.
            fresh = self._again(task, judged.doubtful)
            if isinstance(fresh, Outcome):
                return fresh
            row = self.scratch / f"{file_name(label)}-again.npy"
            _remove(row)
            np.save(row, fresh)
            judged = self._judge_once(task, checked, told, known | {judged.doubtful: row})
        if isinstance(judged, Outcome):
            return judged
        kept = judged.kept or self._kept_from_call_to_call(task, judged, told)
        if judged.faults or kept:
            status: Status = "invalid" if judged.faults else "not_comparable"
            return not_ok(status, *judged.faults, *kept)
        # Of a cell's first process the call whose surface kept its numbers, else any timed one.
        number = 1 if SECOND_CALL in told.names else self._any_timed(told)
        self._keep(task, told.motions[number], self._row(task, told, number))
        return judged

    def _any_timed(self, told: TimedPart) -> int:
        return random.SystemRandom().randrange(int(told.names[0] == WARM_UP), len(told.names))

    def _row(self, task: Task, told: TimedPart, number: int) -> NDArray[np.complex128]:
        """Return the map of a call in the surface's own order."""
        rows = np.lib.format.open_memmap(self.scratch / "uv.npy", mode="r")
        return in_first_order(np.array(rows[number]), task.mesh, told.motions[number])

    def _again(self, task: Task, motion: str) -> NDArray[np.complex128] | Outcome:
        """Return a sample of the map that a new process makes of the surface in this motion."""
        maps = self.scratch / "maps.npy"
        (self.scratch / "uv.npy").replace(maps)
        again = self._run(task, "again", self.options.timeout, motions=(motion,))
        uv = _read_uv(self.scratch / "uv.npy", task)
        maps.replace(self.scratch / "uv.npy")
        if uv is None:
            return again.outcome or _unreadable("it holds no outcome")
        return sample(in_first_order(uv, task.mesh, motion))

    def _kept_from_call_to_call(
        self, task: Task, judged: JudgedCalls, told: TimedPart
    ) -> tuple[Fault, ...]:
        """Return the fault that the process before has kept something, if its maps show it.

        Where the maps of both processes differ, new ones are asked how far theirs do.
        """
        label, motion = task.cell.label, told.motions[0]
        if judged.apart is None or judged.faults or task.algorithm.program is not None:
            return ()
        if motion == UNMOVED:  # the check was a new process too
            self._scatter[label] = judged.apart
            return ()
        for _ in range(_MOST_ASKED):
            if kept_from_call_to_call(judged.apart, self._scatter.get(label, 0.0)) is None:
                return ()
            fresh = self._again(task, motion)
            if isinstance(fresh, Outcome):
                return ()
            scatter = difference(sample(self._row(task, told, 0)), fresh)
            self._scatter[label] = max(scatter, self._scatter.get(label, 0.0))
            if scatter <= SAME_MAP:
                break
        fault = kept_from_call_to_call(judged.apart, self._scatter.get(label, 0.0))
        return () if fault is None else (fault,)

    def _judge_once(
        self, task: Task, checked: Checked, told: TimedPart, known: Mapping[str, Path]
    ) -> JudgedCalls | Outcome:
        answer = self._judged(
            task,
            "judge calls",
            checked=checked,
            names=told.names,
            motions=told.motions,
            known=dict(known),
        )
        return answer.judged or answer.outcome or _unreadable("its maps could not be judged")

    def _keep(self, task: Task, motion: str, uv: NDArray[np.complex128]) -> None:
        """Remember the map of this motion for the next process of the cell."""
        file = self.scratch / f"{file_name(task.cell.label)}.npy"
        _remove(file)
        np.save(file, sample(uv))
        self._last[task.cell.label] = (motion, file)

    def _is_long(self, task: Task) -> bool:
        """Whether the first call may be timed; a motion used by another process is not timed."""
        return self._first_seconds.get(task.cell.label, 0.0) > LONG_CALL

    def _judged(self, task: Task, what: JobTask, **more: Any) -> Answer:
        """Return the judgement of a map, by a process that never imported its algorithm."""
        return self._run(task, what, max(self.options.timeout, JUDGE_SECONDS), **more)

    def _run(
        self,
        task: Task,
        what: JobTask,
        seconds: float,
        **more: Any,
    ) -> Answer:
        self._make_scratch()
        answer_file, uv_file, log = (
            self.scratch / name for name in ("answer.json", "uv.npy", "log.txt")
        )
        judges = what.startswith("judge")
        for stale in (answer_file, log, self.scratch / PROGRAMS, *([] if judges else [uv_file])):
            _remove(stale)
        job = Job(
            task=what,
            cell=task.cell,
            plugins=() if judges else task.plugins,
            mesh_type=type(task.mesh).__name__,
            notices=task.mesh.notices,
            mesh_files=self._mesh_files(task),
            answer_file=answer_file,
            uv_file=uv_file,
            promise=Promise.of(task.algorithm),
            memory_bytes=self.options.memory_bytes,
            parent=os.getpid(),
            **more,
        )
        limits = Limits(seconds, self.options.memory_bytes)
        ending = (self._by_judges if judges else self._forked)(job, limits, log)
        ending = ending or self._started(job, limits, log)
        with suppress(OSError):  # the folder may be gone
            _remove(self.scratch / PROGRAMS)  # of a program that was ended
        if ending.limit is None and ending.code == 0 and answer_file.exists():
            answer = _with_note(_read_answer(answer_file), ending.left)
            return answer.model_copy(update={"running": ending.running})
        with suppress(OSError):  # it, or the folder, may be gone
            uv_file.unlink()
        outcome = _outcome_of(ending, seconds, self.options.memory_bytes)
        if not self.scratch.is_dir():
            gone = _fault(
                FaultKind.PROCESS_ENDED,
                f"the folder for its answer no longer exists: {self.scratch}",
            )
            outcome = _with_fault(outcome, gone)
        return Answer(outcome=outcome)

    def _make_scratch(self) -> None:
        """Recreate the scratch folder, whatever an algorithm did to it."""
        self.scratch = self.scratch.absolute()  # a process may run in a different folder
        if not self.scratch.is_dir():
            self.scratch.unlink(missing_ok=True)
            self.scratch.mkdir(parents=True)
        self.scratch.chmod(0o700)

    def _started(self, job: Job, limits: Limits, log: Path) -> ProcessEnd:
        command = [sys.executable, "-m", "cembench.running.worker", str(self._write(job))]
        start = spawning(command, for_measuring(job.cell.threads))
        return run_limited(start, limits, log, stopped=self._stopped.is_set)

    def _forked(self, job: Job, limits: Limits, log: Path) -> ProcessEnd | None:
        """Run a process forked from the server; return its end, None if it cannot fork."""
        if not self.forks or not can_fork(job.cell.threads):
            return None
        if self._server is None or self._server.backend != job.cell.backend:
            self.close()
            try:
                self._server = ForkServer(for_measuring(job.cell.threads), job.cell.backend)
            except ServerGoneError:
                self.forks = False
                return None
        path = self._write(job.model_copy(update={"parent": self._server.pid}))
        try:
            forking = self._server.forking(path)
            return run_limited(forking, limits, log, stopped=self._stopped.is_set)
        except ServerGoneError:
            self.close()
            return None

    def _by_judges(self, job: Job, limits: Limits, log: Path) -> ProcessEnd | None:
        """Run a judge forked from its server; return how it ended, None if it cannot be forked."""
        server = _judges(self.number)
        if server is None:
            return None
        path = self._write(job.model_copy(update={"parent": server.pid}))
        try:
            forking = server.forking(path)
            return run_limited(forking, limits, log, alone=True, stopped=self._stopped.is_set)
        except ServerGoneError:
            _judges.cache_clear()
            server.close()
            return None

    def _write(self, job: Job) -> Path:
        path = self.scratch / "job.json"
        _remove(path)
        path.write_text(job.model_dump_json())
        return path

    def _mesh_files(self, task: Task) -> tuple[Path, Path]:
        """Return the files of V and F, written once per surface unless a cell changed them."""
        stem = task.cell.mesh_hash[:32]
        files = self.scratch / f"{stem}-V.npy", self.scratch / f"{stem}-F.npy"
        for file, array in zip(files, (task.mesh.V, task.mesh.F), strict=True):
            if not file.exists() or _stamp(file) != self._written.get(file):
                _remove(file)
                np.save(file, array)
                self._written[file] = _stamp(file)
        return files


@cache
def _judges(number: int) -> ForkServer | None:
    """Return the server that forks the judges of this number; it ends with this process."""
    if not can_fork(1):
        return None
    try:
        server = ForkServer(for_measuring(1), default_backend())
    except ServerGoneError:
        return None
    atexit.register(server.close)
    return server


def _remove(path: Path) -> None:
    """Remove whatever is at the path of one of our own files in the scratch folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _stamp(file: Path) -> tuple[int, ...]:
    about = file.stat()
    return about.st_ino, about.st_size, about.st_mtime_ns


def _read_answer(file: Path) -> Answer:
    """Return a process's answer, or a fault: an algorithm may have written to the file."""
    try:
        size = file.stat().st_size
        if size > LARGEST_ANSWER_BYTES:
            raise ValueError(f"it takes {size:,} bytes; allowed are {LARGEST_ANSWER_BYTES:,}")
        return Answer.model_validate_json(file.read_bytes())
    except ValidationError as error:
        return Answer(outcome=_unreadable(error.errors()[0]["msg"]))
    except (OSError, ValueError) as error:
        return Answer(outcome=_unreadable(str(error)))


def _read_uv(file: Path, task: Task) -> NDArray[np.complex128] | None:
    """Return the map that a check left, if any; raise ValueError if it is not a map."""
    if not file.exists():
        return None
    uv = np.lib.format.open_memmap(file, mode="r")
    entries = 3 * task.mesh.m if task.algorithm.target == "atlas" else task.mesh.n
    if uv.shape != (entries,) or uv.dtype != np.complex128:
        raise ValueError(f"uv is {uv.dtype} {uv.shape}; required is complex128 ({entries},)")
    return np.array(uv)


def _fault(kind: FaultKind, detail: str) -> Fault:
    return Fault(kind=kind, detail=detail)


def _unreadable(why: str) -> Outcome:
    told = f"the process left an answer that cannot be read: {why}"
    return not_ok("failed", _fault(FaultKind.UNREADABLE_ANSWER, told))


def _with_fault(outcome: Outcome, fault: Fault) -> Outcome:
    cause = f"{outcome.cause}; {fault.detail}"
    return outcome.model_copy(update={"cause": cause, "faults": (*outcome.faults, fault)})


def _with_note(answer: Answer, left: int) -> Answer:
    """Add the notice that a checked call left processes behind."""
    if answer.outcome is None or not left:
        return answer
    hidden = "" if finds_all() else "; others, with another environment, may live on"
    told = f"left {left} processes behind, which were ended{hidden}"
    notes = (*answer.outcome.notes, Notice(NoticeKind.PROCESSES_LEFT, told))
    return Answer(outcome=answer.outcome.model_copy(update={"notes": notes}))


def _outcome_of(ending: ProcessEnd, seconds: float, memory_bytes: int | None) -> Outcome:
    """Return the outcome of a process that left no answer."""
    seen = {"traceback": ending.said or None, "peak_memory_bytes": ending.seen_bytes or None}
    if ending.limit == "time":
        told = f"not finished after {seconds:g} s"
        return not_ok("timeout", _fault(FaultKind.TIMEOUT, told), **seen)
    if ending.limit == "memory":
        told = f"{_mib(ending.seen_bytes)} resident, the limit is {_mib(memory_bytes or 0)}"
        return not_ok("out_of_memory", _fault(FaultKind.OUT_OF_MEMORY, told), **seen)
    told = f"the process {ending.how}"
    return not_ok("failed", _fault(FaultKind.PROCESS_ENDED, told), **seen)


def _too_large(faces: int, expected: float, limit: int) -> Fault:
    """Return the fault that a call was not started, since its memory would not suffice."""
    told = (
        f"not started: {faces:,} triangles need about {_mib(expected)} by estimate, the limit is "
        f"{_mib(limit)}; --memory sets another one"
    )
    return _fault(FaultKind.OUT_OF_MEMORY, told)


def _mib(size: float) -> str:
    return f"{size / 2**20:,.0f} MiB"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
