"""Run cells on a cluster: send units to workers, and save their records in the run's folder.

Dask's scheduler decides which worker measures a unit, and sends the unit of a worker that is lost
to another one. There are never more units under way than workers: so a lost worker had one unit,
and no other is suspected of having ended it.
"""

from __future__ import annotations

import uuid
import warnings
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from distributed import Client, Future, KilledWorker, LocalCluster
from pydantic import ValidationError

from cembench.core.errors import ClusterError
from cembench.results import run_folder
from cembench.results.intervals import next_look
from cembench.results.machines import differences
from cembench.results.records import Fault, FaultKind, Record, not_ok
from cembench.results.store import Store
from cembench.results.verify import Depth, verify
from cembench.running.cluster.connect import refusals
from cembench.running.cluster.state import ClusterState, MachineState, save_state
from cembench.running.cluster.units import Parcel, grouped, makespan, parcel
from cembench.running.cluster.worker import Answer, describe_worker, forget, measure_unit
from cembench.running.estimate import estimate
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.recorder import Recorder, now, record_of, recording
from cembench.running.watcher import Step, Watcher

#: Number of lost workers after which a unit is recorded as failed.
MOST_LOST = 2
#: Seconds between two looks at the connected workers.
LOOK_EVERY = 1.0
#: Seconds between two saves of the progress.
STATE_EVERY = 5.0
#: Seconds without any worker before a message says so.
_PATIENCE = 5.0
#: Seconds without any worker after which a run on this machine's own workers ends: dask restarts
#: them, but only so often. On other clusters, workers can join at any time.
LOCAL_PATIENCE = 120.0
_UNKNOWN_MACHINE = "a machine of the cluster"


def run_on_cluster(
    tasks: Sequence[Task],
    store: Store,
    client: Client,
    options: Options | None = None,
    watcher: Watcher | None = None,
    *,
    same_environment: bool = False,
) -> list[Record]:
    """Measure the cells that the store does not hold on a cluster; return records in order.

    Like :func:`cembench.running.local.run_tasks`, which each worker calls. The budget is that of
    each machine, and a unit gets its share. With `same_environment`, machines with other software
    measure nothing.

    Raises
    ------
    ClusterError
        The scheduler is gone, or a worker cannot measure; finished units are in the store.

    """
    with recording(tasks, store, options, watcher) as recorder:
        run = _ClusterRun(recorder, client, same_environment)
        try:
            run.measure(recorder.pending(tasks))
        finally:
            run.cancel()
    return [recorder.records[task.cell.label] for task in tasks]


@dataclass
class _Assignment:
    """A unit that is sent to a worker, or waits for one."""

    parcel: Parcel
    future: Future | None = None
    #: Addresses of the workers that took it, and what the last one does.
    workers: list[str] = field(default_factory=list)
    activity: str = ""
    #: When it was taken.
    since: float = field(default_factory=monotonic)

    @property
    def during(self) -> str:
        """The activity, to be appended to a message."""
        return f" in {self.activity}" if self.activity else ""


@dataclass
class _ClusterRun:
    """One sitting: the units that wait, and those that workers have."""

    recorder: Recorder
    client: Client
    same_environment: bool
    topic: str = field(default_factory=lambda: f"cembench-{uuid.uuid4().hex[:12]}")
    #: Events of workers, and assignments whose futures are done.
    events: SimpleQueue[Mapping[str, Any] | tuple[_Assignment, Future]] = field(
        default_factory=SimpleQueue
    )
    waiting: deque[_Assignment] = field(default_factory=deque)
    #: By the keys of their units.
    sent: dict[str, _Assignment] = field(default_factory=dict)
    state: ClusterState = field(default_factory=lambda: ClusterState(units=0))
    #: The connected workers, and those whose software is not allowed, by their addresses.
    workers: list[str] = field(default_factory=list)
    refused: set[str] = field(default_factory=set)
    #: By the addresses of workers, also of those that are lost.
    machines: dict[str, MachineState] = field(default_factory=dict)
    environments: dict[str, dict[str, Any]] = field(default_factory=dict)
    #: When the workers were looked at, when there was one, and when the progress was saved.
    looked: float = 0.0
    alone_since: float = field(default_factory=monotonic)
    saved: float = 0.0
    reported_alone: bool = False
    #: The software of the last machine that is refused.
    differing: str = ""
    #: Expected and actual seconds of the units that are done.
    expected: float = 0.0
    taken: float = 0.0

    @property
    def watcher(self) -> Watcher:
        return self.recorder.watcher

    def measure(self, pending: Sequence[Task]) -> None:
        if not pending:
            return
        self._look()
        self.waiting.extend(_Assignment(one) for one in self._parcels(pending))
        self.state.units = len(self.waiting)
        rounds = next_look(0, self.recorder.options.most_rounds)
        self.watcher.begins(sum(1 + (task.cell.repeats or rounds) for task in pending))
        self.client.subscribe_topic(self.topic, lambda event: self.events.put(event[1]))
        self._save_state(at_once=True)
        while self.waiting or self.sent:
            while self.waiting and len(self.sent) < len(self._usable()):
                self._submit(self.waiting.popleft())
            self._handle_next()
        self._save_state(at_once=True)

    def cancel(self) -> None:
        """Cancel the units that workers have; the workers notice it."""
        futures = [one.future for one in self.sent.values() if one.future is not None]
        with suppress(Exception):  # the scheduler may be gone
            self.client.unsubscribe_topic(self.topic)
        if futures and self.client.status == "running":
            with suppress(Exception):
                self.client.cancel(futures, force=True)

    def _parcels(self, pending: Sequence[Task]) -> list[Parcel]:
        """Pack the units, the longest first: a long last one would keep the others waiting."""
        options = self.recorder.options
        token = run_folder.claim(self.recorder.store.folder).token or ""
        if options.fresh or options.rerun_failed:
            token += self.topic  # unfinished units of earlier runs are not resumed
        known: dict[str, list[Record]] = {}
        for record in verify(self.recorder.store, Depth.records).records:
            known.setdefault(record.cell.algorithm, []).append(record)
        groups = grouped(pending)
        costs = [
            sum(
                estimate(t.cell, t.facts.faces, known.get(t.cell.algorithm, ())).seconds
                for t in group
            )
            for group in groups
        ]
        share = options.budget
        if share is not None:  # per expected second, so that all units are cut by the same factor
            share *= max(1, len(self.workers)) / sum(costs)
        parcels = []
        for group, seconds in zip(groups, costs, strict=True):
            own = replace(options, budget=None if share is None else share * seconds)
            parcels.append(parcel(group, token, own, seconds))
        return sorted(parcels, key=lambda one: -one.seconds)

    def _usable(self) -> list[str]:
        return [worker for worker in self.workers if worker not in self.refused]

    def _submit(self, assignment: _Assignment) -> None:
        one = assignment.parcel
        where = {"workers": self._usable()} if self.refused else {}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that the arrays are large
            future = self.client.submit(
                measure_unit,
                one.unit.model_dump_json(),
                one.plugin_files,
                (one.surface.V, one.surface.F),
                self.topic,
                key=f"cembench-unit-{one.unit.key}-{uuid.uuid4().hex[:6]}",
                pure=False,
                **where,
            )
        assignment.future = future
        self.sent[one.unit.key] = assignment
        future.add_done_callback(lambda done: self.events.put((assignment, done)))

    def _submit_again(self, assignment: _Assignment) -> None:
        del self.sent[assignment.parcel.unit.key]
        self.waiting.appendleft(assignment)

    def _handle_next(self) -> None:
        with suppress(Empty):
            event = self.events.get(timeout=LOOK_EVERY)
            if isinstance(event, Mapping):
                assignment = self.sent.get(event["unit"])
                if assignment is not None:
                    self._handle_event(assignment, event)
            elif event[0].future is event[1]:
                self._handle_end(*event)
        if monotonic() - self.looked > LOOK_EVERY:
            self._look()

    def _look(self) -> None:
        """Update the connected workers, and describe the new ones.

        Raises
        ------
        ClusterError
            The scheduler cannot be reached, or no worker is left that can measure.

        """
        self.looked = monotonic()
        if self.client.status != "running":
            raise self._scheduler_gone()
        try:
            connected = sorted(self.client.nthreads())
            new = [worker for worker in connected if worker not in self.environments]
            described = (
                self.client.run(describe_worker, workers=new, on_error="return") if new else {}
            )
        except (OSError, TimeoutError) as error:
            raise self._scheduler_gone() from error
        for worker, environment in described.items():
            if not isinstance(environment, Exception):
                self._add_worker(worker, environment)
            elif not isinstance(environment, OSError):  # which means that it is gone again
                raise ClusterError(
                    f"the worker {worker} cannot measure: {environment}. Install the same version "
                    "of cembench on all machines."
                )
        connected = [worker for worker in connected if worker in self.environments]
        if connected != self.workers:
            for worker in set(self.workers) - set(connected):
                self.machines[worker].lost = True
            self.workers = connected
            self.watcher.machines([self._machine_of(worker) for worker in connected])
        if connected and not self._usable():
            raise ClusterError.about(
                "no worker has the software of this machine ({differing}). Install the same on the "
                "workers, or leave out {same_environment}.",
                differing=self.differing,
            )
        if connected:
            self.alone_since = self.looked
        alone = self.looked - self.alone_since
        if isinstance(self.client.cluster, LocalCluster) and alone > LOCAL_PATIENCE:
            raise ClusterError(
                f"all workers of this machine are gone, and none was restarted within "
                f"{LOCAL_PATIENCE:g} s; {self._saved_cells()}. Check whether the memory suffices; "
                "the same command goes on."
            )
        refused = refusals(self.client.cluster)
        if refused and len(refused) >= len(self.client.cluster.worker_spec) and not self.workers:
            raise ClusterError.about(
                "Slurm takes no job: {cause}; {kept}. Correct the settings in {cluster}; the same "
                "command goes on.",
                cause=refused[-1],
                kept=self._saved_cells(),
            )
        if alone > _PATIENCE and not self.reported_alone:
            self.reported_alone = True
            self.watcher.shows("no worker is connected yet; waiting for one")
        self._save_state()

    def _add_worker(self, worker: str, environment: dict[str, Any]) -> None:
        """Note a new worker; show once a machine if its software differs from the client's."""
        machine = environment["machine"]
        others = differences(self.recorder.environment, environment)
        is_new = all(state.machine != machine for state in self.machines.values())
        self.machines[worker] = MachineState(machine=machine)
        self.environments[worker] = environment
        if not others:
            return
        text = "; ".join(others)
        if self.same_environment:
            self.refused.add(worker)
            self.differing = f"{machine}: {text}"
            self.watcher.shows(f"{machine} measures nothing: its software differs: {text}")
        elif is_new:
            self.watcher.shows(f"{machine} has other software: {text}")

    def _machine_of(self, worker: str) -> str:
        """Return the name of a worker's machine; a worker may be lost before it is described."""
        return self.machines[worker].machine if worker in self.machines else _UNKNOWN_MACHINE

    def _saved_cells(self) -> str:
        return f"{len(self.recorder.records)} finished cells are in {self.recorder.store.folder}"

    def _scheduler_gone(self) -> ClusterError:
        left = len(self.waiting) + len(self.sent)
        return ClusterError(
            f"the scheduler is gone; {self._saved_cells()}, {left} surfaces are left. Start a "
            "scheduler and workers; the same command goes on."
        )

    def _handle_event(self, assignment: _Assignment, event: Mapping[str, Any]) -> None:
        """Show the progress of a unit."""
        task = assignment.parcel.by_label.get(event.get("cell", ""))
        if event["worker"] not in self.machines:  # it joined after the last look
            self._look()
        if event["what"] == "takes":
            self._handle_taken(assignment, event["worker"])
        elif event["what"] == "queues":
            assignment.activity = "waits for another worker of its machine"
        elif task is not None and event["what"] == "adds_rounds":
            self.watcher.adds_rounds(task, event["rounds"])
        elif task is not None:
            step = Step(**event["step"])
            assignment.activity = f"{step} of {task.cell.algorithm}"
            if event["what"] == "starts":
                self.watcher.starts(task, step)
            else:
                self.watcher.ends(task, step, event["seconds"])
        if event["worker"] in self.machines:
            mesh = assignment.parcel.unit.mesh
            activity = f"{mesh}: {assignment.activity}" if assignment.activity else mesh
            self.machines[event["worker"]].at = activity

    def _handle_taken(self, assignment: _Assignment, worker: str) -> None:
        """Note which worker measures a unit; give up a unit that has ended too many workers."""
        unit = assignment.parcel.unit
        if assignment.workers:
            self.watcher.shows(
                f"{unit.mesh} ({unit.cells[0].solves}) is measured again on "
                f"{self._machine_of(worker)}: the worker on "
                f"{self._machine_of(assignment.workers[-1])} was lost{assignment.during}"
            )
        assignment.workers.append(worker)
        assignment.since = monotonic()
        if len(assignment.workers) > MOST_LOST and assignment.future is not None:
            future, assignment.future = assignment.future, None
            with suppress(Exception):
                self.client.cancel([future], force=True)
            self._give_up(assignment)

    def _handle_end(self, assignment: _Assignment, future: Future) -> None:
        if future.status == "finished":
            self._handle_answer(assignment, future.result())
        elif future.status in ("cancelled", "lost"):
            if self.client.status != "running":
                raise self._scheduler_gone()
            self._submit_again(assignment)
        elif isinstance(error := future.exception(), KilledWorker):
            self._give_up(assignment)
        else:
            mesh, workers = assignment.parcel.unit.mesh, assignment.workers
            where = f" on {self._machine_of(workers[-1])}" if workers else ""
            raise ClusterError(f"{mesh} cannot be measured{where}: {error}") from error

    def _handle_answer(self, assignment: _Assignment, answer: Answer) -> None:
        """Save the records of a unit."""
        if answer.worker not in self.machines:
            self._look()
        machine = self._machine_of(answer.worker)
        state = self.machines.setdefault(answer.worker, MachineState(machine=machine))
        state.at = ""
        tasks = {task.cell.key: task for task in assignment.parcel.tasks}
        for content, uv in answer.records:
            try:
                record = Record.model_validate_json(content)
            except ValidationError as error:
                why = f"{state.machine} sent a record that cannot be read"
                raise ClusterError(f"{why}: {error.errors()[0]['msg']}.") from error
            task = tasks.pop(record.cell.key, None)
            environment = answer.environments.get(record.environment)
            if task is not None and environment is not None:
                self.recorder.save(task, record, uv, environment)
        if tasks:
            raise ClusterError(f"{state.machine} sent no record of {len(tasks)} cells; run again.")
        state.units += 1
        self._count(assignment)
        key = assignment.parcel.unit.key
        with suppress(Exception):  # it is deleted after some days anyway
            self.client.run(forget, key, workers=[answer.worker], wait=False)

    def _give_up(self, assignment: _Assignment) -> None:
        """Record the cells of a unit that ended its workers as failed."""
        last = assignment.workers[-1] if assignment.workers else ""
        machine = self._machine_of(last)
        environment = self.environments.get(last, self.recorder.environment)
        detail = (
            f"its surface ended {MOST_LOST} workers that measured it, the last on "
            f"{machine}{assignment.during}"
        )
        outcome = not_ok("failed", Fault(kind=FaultKind.WORKERS_LOST, detail=detail))
        for task in assignment.parcel.tasks:
            record = record_of(task, outcome, environment["id"], now())
            self.recorder.save(task, record, None, environment)
        self._count(assignment)

    def _count(self, assignment: _Assignment) -> None:
        """Count a unit as done."""
        self.sent.pop(assignment.parcel.unit.key, None)
        self.state.done += 1
        self.expected += assignment.parcel.seconds
        self.taken += monotonic() - assignment.since
        self._save_state(at_once=True)

    def _seconds_left(self) -> float | None:
        """Return the estimated seconds left, by what finished units took; None before the first."""
        if not self.expected or not self.workers:
            return None
        slower = self.taken / self.expected
        left = [slower * one.parcel.seconds for one in self.waiting]
        for one in self.sent.values():
            left.append(max(0.0, slower * one.parcel.seconds - (monotonic() - one.since)))
        return makespan(left, max(1, len({self._machine_of(w) for w in self._usable()})))

    def _save_state(self, *, at_once: bool = False) -> None:
        if at_once or monotonic() - self.saved > STATE_EVERY:
            self.saved = monotonic()
            self.state.machines = list(self.machines.values())
            self.state.seconds_left = self._seconds_left()
            save_state(self.recorder.store.folder, self.state)
