"""Run cells on this machine: each process alone, in rounds, so that drift hits all alike.

First every cell is checked: one call in a process of its own, whose map is verified and whose
memory is measured. What ends ok is then timed in rounds. A round has a fresh process for every
cell, in a random order, so a machine that slows down slows them all. A cell has a fixed number of
rounds, or is measured until its intervals are narrow (:mod:`cembench.running.until_precise`), as
long as time is left. Where that is possible the processes of a round are forked from one that has
loaded the libraries (:mod:`cembench.running.fork_server`), another one each round: what differs
from one interpreter to the next (addresses, hash seeds) is the same for all cells of a round, and
averaged over.
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
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from math import inf
from pathlib import Path
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
from cembench.results.records import Fault, FaultKind, Outcome, Record, Round, Status, not_ok
from cembench.results.samples import Samples
from cembench.results.store import Store
from cembench.running.comparable import impossible, incomparable, is_cold
from cembench.running.environment import describe_environment, with_threads
from cembench.running.external.present import external_of
from cembench.running.fork_server import ForkServer, ServerGoneError, can_fork
from cembench.running.judge import Promise
from cembench.running.judging import Checked, JudgedCalls, sample
from cembench.running.kernel import kernel_seconds
from cembench.running.measure import ENOUGH_CALLS, LONG_CALL, WARM_UP
from cembench.running.motion import UNMOVED
from cembench.running.neighbours import counters, neighbours
from cembench.running.plan import Task
from cembench.running.process import Limits, ProcessEnd, run_limited, spawning
from cembench.running.side_by_side import check_side_by_side
from cembench.running.until_precise import affordable, cost, lack
from cembench.running.worker import PROGRAMS, Answer, Job, JobTask

#: Wall-clock seconds that a call may take unless the user says otherwise.
DEFAULT_TIMEOUT = 600.0
#: Wall-clock seconds that judging a map may take at least.
JUDGE_SECONDS = 600.0
#: Seconds after which no cell goes on that has had its first look, unless the user says otherwise.
USUAL_BUDGET = 1800.0
#: The largest answer that is read: what a worker keeps takes a few megabytes at most.
LARGEST_ANSWER_BYTES = 2**24


@dataclass(frozen=True)
class Options:
    """How a run goes about its cells."""

    #: A process that times has twice as long, as it makes two calls or more.
    timeout: float = DEFAULT_TIMEOUT
    #: Resident bytes of a process and all that it starts; None: no limit.
    memory_bytes: int | None = None
    #: Measure again what the store holds.
    fresh: bool = False
    #: Measure again what the store holds and did not end ok.
    rerun_failed: bool = False
    #: Of the random order within each round.
    seed: int = 0
    #: With which algorithm the others are compared: their ratios to it become precise.
    reference: str = REFERENCE
    #: Rounds of a cell that is measured until it is precise, at most.
    most_rounds: int = USUAL_MOST_ROUNDS
    #: Wall-clock seconds after which no cell goes on that has had its first look; None: no limit.
    budget: float | None = None
    #: How often a process is run again beside which the machine was busy; the quietest counts.
    repeat_busy: int = 0
    #: So many checks run side by side, each with its share of the memory. What is timed runs alone.
    jobs: int = 1

    def measures_again(self, kept: Record) -> bool:
        """Whether a cell is measured again although it has this record."""
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
    """Is told how a run goes on; a subclass shows it."""

    def waits(self) -> None:
        """Another run measures into the folder; this one goes on when that has ended."""

    def begins(self, processes: int) -> None:
        """So many processes are to be run."""

    def timing_begins(self) -> None:
        """All checks have ended; what is run from now on is timed."""

    def goes_on(self, task: Task, rounds: int) -> None:
        """A cell is not precise yet: so many more rounds of it follow."""

    def starts(self, task: Task, step: Step) -> None:
        """A process starts."""

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """It has ended, after so many seconds in all."""

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """A cell's record is there, from before if `kept`; no more processes are run for it."""

    def machines(self, names: Sequence[str]) -> None:
        """These machines of a cluster take part now, one name for each worker."""

    def tells(self, words: str) -> None:
        """Something happened to a machine of the cluster, or to what it measured."""


def run_tasks(
    tasks: Sequence[Task],
    store: Store,
    options: Options | None = None,
    watcher: Watcher | None = None,
    launcher: Callable[[Path, Options], Launcher] | None = None,
    *,
    environment: dict[str, Any] | None = None,
) -> list[Record]:
    """Measure what the store does not hold yet; the records, in the tasks' order.

    Each process's result is on disk before the next one starts. A second run into the same store
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
            outcome, uv = Launcher(Path(folder), options or Options()).check(task)
    except OSError as error:
        raise RecordError(
            f"the temporary folder cannot be used: {error.strerror or error}. Make room in it, or "
            "set TMPDIR to another."
        ) from error
    return record_of(task, outcome, describe_environment()["id"], started), uv


def in_random_order(tasks: Sequence[Task], seed: int, number: int) -> list[Task]:
    """The order of a round: another one each round, the same for the same seed."""
    return random.Random(f"{seed} {number}").sample(list(tasks), len(tasks))


def kept_record(
    task: Task, store: Store, options: Options, asked: AbstractSet[str]
) -> Record | None:
    """Return the record that stands, if any; samples of what is measured anew are forgotten.

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
    """One sitting: what it has to do is worked out from what the store holds."""

    store: Store
    launcher: Launcher
    options: Options
    watcher: Watcher
    environment: dict[str, Any]
    sitting: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    records: dict[str, Record] = field(default_factory=dict)
    since: float = field(default_factory=monotonic)
    #: What the journals hold, by the cells' labels.
    checks: dict[str, Outcome] = field(default_factory=dict)
    rounds: dict[str, dict[int, Round]] = field(default_factory=dict)

    def measure(self, tasks: Sequence[Task]) -> None:
        asked = {task.cell.label for task in tasks}
        pending = [task for task in tasks if not self._is_kept(task, asked)]
        for task in pending:
            self._load(task)
        self.watcher.begins(sum(self._processes_left(task) for task in pending))
        self._check_all(pending)
        self.watcher.timing_begins()
        most = max((task.cell.repeats or self.options.most_rounds for task in pending), default=0)
        for number in range(most + 1):
            if is_look(number, self.options.most_rounds):
                self._look(pending, number)
            open_ = [task for task in pending if self._lacks(task, number)]
            if not open_:
                continue
            self.launcher.close()
            kernel = kernel_seconds()
            for task in in_random_order(open_, self.options.seed, number):
                self._time(task, number, kernel)

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
        """Return the number of the round after which a cell ends, or is looked at next."""
        return task.cell.repeats or next_look(done, self.options.most_rounds)

    def _check_all(self, pending: Sequence[Task]) -> None:
        """Check what is not checked yet, one after another or side by side."""
        new = [task for task in pending if task.cell.label not in self.checks]
        for task in pending:
            if task.cell.label in self.checks:
                self._go_on_from_check(task)
        if self.options.jobs < 2 or len(new) < 2:
            for task in new:
                with self._checking(task):
                    outcome, uv = self.launcher.check(task)
                self._keep_check(task, outcome, uv)
            return
        launchers = self.launcher.for_checks(self.options.jobs)
        for task, (outcome, uv), launcher in check_side_by_side(new, launchers, self._checking):
            self.launcher.take_over(launcher, task)
            self._keep_check(task, outcome, uv)

    def _checking(self, task: Task) -> _Process:
        return _Process(self.watcher, task, self._step(task, None))

    def _keep_check(self, task: Task, outcome: Outcome, uv: NDArray[np.complex128] | None) -> None:
        self._samples(task).save_check(outcome, uv)
        self.checks[task.cell.label] = outcome
        self._go_on_from_check(task)

    def _go_on_from_check(self, task: Task) -> None:
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
        """End the cells that are precise, or cannot be measured on; references outlast the rest.

        A cell that has more rounds, from before a kill, went on when this was asked before.
        """
        last = number >= self.options.most_rounds
        open_ = {
            task.cell.label: task
            for task in pending
            if task.cell.label not in self.records
            and task.cell.precision is not None
            and (last or len(self.rounds[task.cell.label]) == number)
        }
        partners = _partners(open_.values(), self.options.reference)
        rounds = {label: list(self.rounds[label].values()) for label in open_}
        lacks = {}
        for label, task in open_.items():
            partner = partners.get(label)
            beside = (open_[partner].cell, rounds[partner]) if partner else None
            lacks[label] = lack(task.cell, rounds[label], beside)
        more = next_look(number, self.options.most_rounds) - number
        costs = {label: more * cost(rounds[label]) for label in open_}
        go_on = set() if last else affordable(lacks, costs, partners, self._seconds_left())
        for label in sorted(open_.keys() - go_on, key=lambda label: label in partners.values()):
            self._save_measured(open_[label])
        for label in go_on:
            self.watcher.goes_on(open_[label], more)

    def _seconds_left(self) -> float:
        if self.options.budget is None:
            return inf
        return self.options.budget - (monotonic() - self.since)

    def _time(self, task: Task, number: int, kernel: float) -> None:
        step = self._step(task, number)
        started = _now()
        checked = self.checks[task.cell.label]
        with _Process(self.watcher, task, step):
            found = self._quietest(task, Checked.of(checked))
        if isinstance(found, Outcome):
            more: dict[str, Any] = {"cause": f"in {step}: {found.cause}"}
            if found.status == "not_comparable":  # the map is valid, and so are its figures
                more |= {"status": found.status, "faults": found.faults, "rounds": ()}
                found = checked
            self._save(task, found.model_copy(update=more))
            return
        origin = {"sitting": self.sitting, "started_at": started, "kernel_seconds": kernel}
        measured = found.model_copy(update=origin)
        self._samples(task).save_round(number, measured)
        self.rounds[task.cell.label][number] = measured
        self._save_if_complete(task)

    def _quietest(self, task: Task, checked: Checked) -> Round | Outcome:
        """Time one process; again where the machine was busy, as often as that is asked for.

        Which one counts is decided by what others did, and never by the seconds.
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
            self._save_measured(task)

    def _save_measured(self, task: Task) -> None:
        checked = self.checks[task.cell.label]
        rounds = tuple(
            self.rounds[task.cell.label][k] for k in sorted(self.rounds[task.cell.label])
        )
        notes = (*checked.notes, *_notes(checked, rounds))
        self._save(task, checked.model_copy(update={"rounds": rounds, "notes": notes}))

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
    """Return with which cell of the reference each other one is compared, by their labels."""
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


def _disturbed(measured: Round) -> float:
    beside = measured.neighbours
    return 0.0 if beside is None else beside.other_cores + beside.stolen_cores


@dataclass
class _Process:
    """Tells the watcher of a process's start and end."""

    watcher: Watcher
    task: Task
    step: Step
    since: float = field(default_factory=monotonic)

    def __enter__(self) -> None:
        self.watcher.starts(self.task, self.step)

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
        text = f"not deterministic: other maps of the same surface came out in rounds {named}"
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
    """Return the record of a cell that came to this."""
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
    """Starts the processes; `scratch` is where they and it exchange files.

    Those that time are forked from a server where `forks` allows it and the system can. It stands
    until :meth:`close`; the next process gets a new one.
    """

    scratch: Path
    options: Options
    forks: bool = True
    _server: ForkServer | None = None
    #: What the system says of the mesh files since they were written.
    _written: dict[Path, tuple[int, ...]] = field(default_factory=dict)
    #: Nobody can have kept a result for motions that were drawn just now.
    _drawn: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    #: How often each cell was timed.
    _times: Counter[str] = field(default_factory=Counter)
    #: Of each cell, a call of its last process: its motion, and the sample of its map.
    _last: dict[str, tuple[str, Path]] = field(default_factory=dict)
    #: Seconds of each cell's checked call.
    _checked_seconds: dict[str, float] = field(default_factory=dict)
    #: Whether two fresh processes gave the same map of the same surface.
    _repeats: dict[str, bool | None] = field(default_factory=dict)
    #: Which server of judges is asked: one that nobody asks at the same time.
    number: int = 0
    _stopped: threading.Event = field(default_factory=threading.Event)

    def for_checks(self, jobs: int) -> list[Self]:
        """Return so many others like this one, which may check at the same time.

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
        """Know of a task's check what another launcher knows of it."""
        label = task.cell.label
        if label in other._last:
            self._last[label] = other._last[label]
            self._checked_seconds[label] = other._checked_seconds[label]

    def stop(self) -> None:
        """End the process that runs, and every other right after its start."""
        self._stopped.set()

    def close(self) -> None:
        """End the server, if there is one."""
        if self._server is not None:
            self._server.close()
            self._server = None

    def check(self, task: Task) -> tuple[Outcome, NDArray[np.complex128] | None]:
        """What one call comes to, and its map if that has the right shape and is finite."""
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
        self._checked_seconds[task.cell.label] = max(answer.outcome.seconds, default=0.0)
        return judged.outcome, uv

    def time(self, task: Task, checked: Checked) -> Round | Outcome:
        """The timed calls of one process, or how it ended without.

        Their surfaces are moved, for all cells alike. Where calls are short, the first one, which
        only warms up, gets a motion that a call of the process before has had: so what a fresh
        process makes of it is compared with what one did that had been called before.
        """
        label = task.cell.label
        turn = f"{self.options.seed} {self._drawn} {self._times[label]}"
        self._times[label] += 1
        motions = [f"{turn} {k}" for k in range(ENOUGH_CALLS + 1)]
        last = self._last.get(label)
        replays = last is not None and not self._is_long(task)
        if last is not None and replays:
            motions[0] = last[0]
        began = monotonic()
        answer = self._run(
            task,
            "time",
            2 * self.options.timeout,
            motions=tuple(motions),
            first_counts=not replays,
        )
        ended = monotonic()
        found, used = answer.round, answer.used
        if found is None or used is None:
            return answer.outcome or _unreadable("it holds no round")
        if not set(answer.motions) <= set(motions) or len(answer.names) != len(answer.motions):
            return _unreadable("it tells of other calls than were asked for")
        used.wall, used.cold = sum(found.calls), found.cold_seconds or 0.0
        wrong = impossible(used, found, began, ended)
        wrong = wrong or incomparable(used, answer.running, task.cell.threads)
        if wrong:
            return not_ok("not_comparable", *wrong)
        judged = self._judged_calls(task, checked, answer)
        if isinstance(judged, Outcome):
            return judged
        return found.model_copy(update={"motions": turn, "repeated": judged.repeated})

    def _judged_calls(self, task: Task, checked: Checked, told: Answer) -> JudgedCalls | Outcome:
        """What is to be said of the maps of a process; an outcome where that is nothing good."""
        label = task.cell.label
        known = dict([self._last[label]]) if label in self._last else {}
        judged = self._judge_once(task, checked, told, known)
        if isinstance(judged, JudgedCalls) and judged.doubtful is not None and not judged.faults:
            # The surface, or the method, is one where rounding decides which of several maps.
            maps = self.scratch / "maps.npy"
            (self.scratch / "uv.npy").replace(maps)
            again = self._run(task, "again", self.options.timeout, motions=(judged.doubtful,))
            uv = _read_uv(self.scratch / "uv.npy", task)
            if uv is None:
                return again.outcome or _unreadable("it holds no outcome")
            row = self.scratch / f"{file_name(label)}-again.npy"
            _remove(row)
            np.save(row, sample(uv))
            maps.replace(self.scratch / "uv.npy")
            judged = self._judge_once(task, checked, told, known | {judged.doubtful: row})
        if isinstance(judged, Outcome):
            return judged
        if judged.faults or judged.kept:
            status: Status = "invalid" if judged.faults else "not_comparable"
            return not_ok(status, *judged.faults, *judged.kept)
        if UNMOVED in known:
            self._repeats[label] = judged.repeated
        number = random.SystemRandom().randrange(int(told.names[0] == WARM_UP), len(told.names))
        rows = np.lib.format.open_memmap(self.scratch / "uv.npy", mode="r")
        self._keep(task, told.motions[number], np.array(rows[number]))
        return judged

    def _judge_once(
        self, task: Task, checked: Checked, told: Answer, known: Mapping[str, Path]
    ) -> JudgedCalls | Outcome:
        answer = self._judged(
            task,
            "judge calls",
            checked=checked,
            names=told.names,
            motions=told.motions,
            known=dict(known),
            repeats=self._repeats.get(task.cell.label),
        )
        return answer.judged or answer.outcome or _unreadable("its maps could not be judged")

    def _keep(self, task: Task, motion: str, uv: NDArray[np.complex128]) -> None:
        """Remember the map of this motion for the next process of the cell."""
        file = self.scratch / f"{file_name(task.cell.label)}.npy"
        _remove(file)
        np.save(file, sample(uv))
        self._last[task.cell.label] = (motion, file)

    def _is_long(self, task: Task) -> bool:
        """May its first call be one that is timed? What another process has had is not timed."""
        return self._checked_seconds.get(task.cell.label, 0.0) > LONG_CALL / 2

    def _judged(self, task: Task, what: JobTask, **more: Any) -> Answer:
        """What a process says of a map that never saw what made it."""
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
        forked = {"time": self._forked, "again": self._forked}
        ending = (self._by_judges if judges else forked.get(what, _never))(job, limits, log)
        ending = ending or self._started(job, limits, log)
        with suppress(OSError):  # there may be no folder any more
            _remove(self.scratch / PROGRAMS)  # of a program that was ended
        if ending.limit is None and ending.code == 0 and answer_file.exists():
            answer = _with_note(_read_answer(answer_file), ending.left)
            return answer.model_copy(update={"running": ending.running})
        with suppress(OSError):  # there may be none, or no folder any more
            uv_file.unlink()
        outcome = _outcome_of(ending, seconds, self.options.memory_bytes)
        if not self.scratch.is_dir():
            gone = _fault(
                FaultKind.PROCESS_ENDED, f"the folder for its answer is gone: {self.scratch}"
            )
            outcome = _with_fault(outcome, gone)
        return Answer(outcome=outcome)

    def _make_scratch(self) -> None:
        """Have the folder to ourselves again, whatever an algorithm did to it."""
        self.scratch = self.scratch.absolute()  # a process may be in another folder than this one
        if not self.scratch.is_dir():
            self.scratch.unlink(missing_ok=True)
            self.scratch.mkdir(parents=True)
        self.scratch.chmod(0o700)

    def _started(self, job: Job, limits: Limits, log: Path) -> ProcessEnd:
        command = [sys.executable, "-m", "cembench.running.worker", str(self._write(job))]
        start = spawning(command, with_threads(job.cell.threads))
        return run_limited(start, limits, log, stopped=self._stopped.is_set)

    def _forked(self, job: Job, limits: Limits, log: Path) -> ProcessEnd | None:
        """How a process ended that the server forked; None where it forks none."""
        if not self.forks or not can_fork(job.cell.threads):
            return None
        if self._server is None or self._server.backend != job.cell.backend:
            self.close()
            try:
                self._server = ForkServer(with_threads(job.cell.threads), job.cell.backend)
            except ServerGoneError:
                self.forks = False
                return None
        path = self._write(job.model_copy(update={"parent": self._server.pid}))
        try:
            return run_limited(self._server.forking(path), limits, log)
        except ServerGoneError:
            self.close()
            return None

    def _by_judges(self, job: Job, limits: Limits, log: Path) -> ProcessEnd | None:
        """How a process ended that the server of judges forked; None where it forks none."""
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
        """V and F on disk, written once for all cells of a surface unless one changed them."""
        stem = task.cell.mesh_hash[:32]
        files = self.scratch / f"{stem}-V.npy", self.scratch / f"{stem}-F.npy"
        for file, array in zip(files, (task.mesh.V, task.mesh.F), strict=True):
            if not file.exists() or _stamp(file) != self._written.get(file):
                _remove(file)
                np.save(file, array)
                self._written[file] = _stamp(file)
        return files


def _never(job: Job, limits: Limits, log: Path) -> None:
    """Fork nothing: a check has an interpreter of its own."""


@cache
def _judges(number: int) -> ForkServer | None:
    """The server that the judges of this number are forked from; it ends with this process."""
    if not can_fork(1):
        return None
    try:
        server = ForkServer(with_threads(1), default_backend())
    except ServerGoneError:
        return None
    atexit.register(server.close)
    return server


def _remove(path: Path) -> None:
    """Remove what stands where one of our own files is to be written in the scratch folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _stamp(file: Path) -> tuple[int, ...]:
    about = file.stat()
    return about.st_ino, about.st_size, about.st_mtime_ns


def _read_answer(file: Path) -> Answer:
    """Return a process's answer; a fault where it is none: an algorithm may have written to it."""
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
    """Return the map that a check left, if it left one; ValueError for anything else."""
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
    """Say of a checked call that it left processes behind."""
    if answer.outcome is None or not left:
        return answer
    told = Notice(NoticeKind.PROCESSES_LEFT, f"left {left} processes behind, which were ended")
    notes = (*answer.outcome.notes, told)
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


def _mib(size: int) -> str:
    return f"{size / 2**20:,.0f} MiB"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
