"""Run cells on a cluster: send units, and save their records in the run's folder at once.

Where a unit goes is decided by dask's scheduler. It gets one unit for each worker that is there, so
that a worker which is lost takes one unit with it and no other is suspected.
"""

from __future__ import annotations

import json
import uuid
import warnings
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

import numpy as np
from distributed import Client, Future, KilledWorker, LocalCluster
from pydantic import ValidationError

from cembench.core.errors import ClusterError
from cembench.results import run_folder
from cembench.results.looks import next_look
from cembench.results.machines import differences, software_of
from cembench.results.records import Fault, FaultKind, Record, not_ok
from cembench.results.store import Store
from cembench.running.cluster.state import ClusterState, MachineState, save_state
from cembench.running.cluster.units import Parcel, grouped, makespan, parcel
from cembench.running.cluster.worker import Answer, MeasurerGoneError, forget, measure_unit
from cembench.running.environment import describe_environment
from cembench.running.estimate import estimate
from cembench.running.local import Options, Step, Watcher, kept_record, record_of
from cembench.running.plan import Task

#: A unit that ended so many workers is recorded as failed.
MOST_LOST = 2
#: Seconds between two looks at which workers are there.
LOOK_EVERY = 1.0
#: Seconds between two writings of how far the run is.
STATE_EVERY = 5.0
#: Seconds for which there may be no worker before that is said.
_PATIENCE = 5.0
#: Seconds for which workers that cembench started on this machine may all be gone: dask starts them
#: again, but only so often. Elsewhere others can join at any time.
LOCAL_PATIENCE = 120.0


def run_on_cluster(
    tasks: Sequence[Task],
    store: Store,
    client: Client,
    options: Options | None = None,
    watcher: Watcher | None = None,
    *,
    faces: int | None = None,
    same_environment: bool = False,
) -> list[Record]:
    """Measure the cells that the store does not hold on a cluster; return records in order.

    As :func:`cembench.running.local.run_tasks`, whose machinery each worker has. The budget is of
    each machine, and a unit gets its share. `faces` is what registered surfaces were made with;
    with `same_environment` a machine with other software than this one measures nothing.

    Raises
    ------
    ClusterError
        The scheduler is gone, or the workers cannot measure; what is finished is in the store.

    """
    options, watcher = options or Options(), watcher or Watcher()
    with store.locked(watcher.waits):
        store.save_plan([task.cell for task in tasks])
        for mesh in {task.cell.mesh_hash: task.mesh for task in tasks}.values():
            store.save_mesh(mesh)
        run = _ClusterRun(
            *(store, client, options, watcher, faces, same_environment, describe_environment())
        )
        try:
            run.measure(tasks)
        finally:
            run.end()
    return [run.records[task.cell.label] for task in tasks]


@dataclass
class _Flight:
    """A unit that a worker has."""

    parcel: Parcel
    future: Future | None = None
    sent_surface: bool = False
    #: Workers that took it, by their addresses; and the machine of the last.
    takers: list[str] = field(default_factory=list)
    machine: str = ""
    doing: str = ""
    #: How often the process of a worker that measures it has ended.
    ended: int = 0
    #: When it was taken.
    since: float = field(default_factory=monotonic)


@dataclass
class _ClusterRun:
    store: Store
    client: Client
    options: Options
    watcher: Watcher
    faces: int | None
    same_environment: bool
    environment: dict[str, Any]
    topic: str = field(default_factory=lambda: f"cembench-{uuid.uuid4().hex[:12]}")
    records: dict[str, Record] = field(default_factory=dict)
    events: SimpleQueue[tuple[str, Any]] = field(default_factory=SimpleQueue)
    waiting: deque[_Flight] = field(default_factory=deque)
    flying: dict[str, _Flight] = field(default_factory=dict)
    state: ClusterState = field(default_factory=lambda: ClusterState(units=0))
    machines: dict[str, MachineState] = field(default_factory=dict)
    environments: dict[str, dict[str, Any]] = field(default_factory=dict)
    refused: set[str] = field(default_factory=set)
    workers: list[str] = field(default_factory=list)
    looked: float = 0.0
    since: float = field(default_factory=monotonic)
    #: Expected seconds of the units that are done, and what they took.
    expected: float = 0.0
    taken: float = 0.0
    saved: float = 0.0
    told_alone: bool = False

    def measure(self, tasks: Sequence[Task]) -> None:
        asked = {task.cell.label for task in tasks}
        pending = []
        for task in tasks:
            kept = kept_record(task, self.store, self.options, asked)
            if kept is None:
                pending.append(task)
            else:
                self._finish(task, kept, kept=True)
        if not pending:
            return
        self._look()
        self.waiting.extend(_Flight(one) for one in self._parcels(pending))
        self.state.units = len(self.waiting)
        rounds = next_look(0, self.options.most_rounds)
        self.watcher.begins(sum(1 + (task.cell.repeats or rounds) for task in pending))
        self.client.subscribe_topic(self.topic, self._hear)
        self._save_state(at_once=True)
        while self.waiting or self.flying:
            self._send()
            self._handle_next()
        self._save_state(at_once=True)

    def end(self) -> None:
        """Cancel the units that workers have; the workers notice it."""
        futures = [flight.future for flight in self.flying.values() if flight.future is not None]
        with suppress(Exception):  # the scheduler may be gone
            self.client.unsubscribe_topic(self.topic)
        if futures and self.client.status == "running":
            with suppress(Exception):
                self.client.cancel(futures, force=True)

    def _parcels(self, pending: Sequence[Task]) -> list[Parcel]:
        """Pack the units, the longest first: a long last one keeps the others waiting."""
        token = run_folder.claim(self.store.folder).token or ""
        if self.options.fresh or self.options.rerun_failed:
            token += self.topic  # what an earlier run left unfinished on a machine does not count
        groups = grouped(pending)
        known: dict[str, list[Record]] = {}
        for record in self.store.finished():
            known.setdefault(record.cell.algorithm, []).append(record)
        software = software_of(self.environment) if self.same_environment else {}
        costs = [
            sum(
                estimate(t.cell, t.facts.faces, known.get(t.cell.algorithm, ())).seconds
                for t in group
            )
            for group in groups
        ]
        share = self.options.budget
        if share is not None:  # of each second that is expected, so that no unit is cut more
            share *= max(1, len(self.workers)) / sum(costs)
        found = []
        for group, seconds in zip(groups, costs, strict=True):
            budget = None if share is None else share * seconds
            options = replace(self.options, budget=budget)
            found.append(parcel(group, token, options, self.faces, software, seconds))
        return sorted(found, key=lambda one: -one.seconds)

    def _hear(self, event: tuple[Any, Mapping[str, Any]]) -> None:
        about = event[1]
        for one in about["events"]:
            self.events.put(("event", {**one, "unit": about["unit"], "machine": about["machine"]}))

    def _send(self) -> None:
        """Send a unit to each worker that has none."""
        while self.waiting and len(self.flying) < len(self._usable()):
            self._submit(self.waiting.popleft())

    def _usable(self) -> list[str]:
        return [worker for worker in self.workers if worker not in self.refused]

    def _submit(self, flight: _Flight, worker: str | None = None) -> None:
        one = flight.parcel
        mesh = one.surface
        arrays = (np.asarray(mesh.V), np.asarray(mesh.F)) if flight.sent_surface else None
        chosen: dict[str, Any] = {}
        if worker is not None:
            chosen = {"workers": [worker], "allow_other_workers": not self.refused}
        elif self.refused:
            chosen = {"workers": self._usable()}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that the arrays are large
            future = self.client.submit(
                measure_unit,
                one.unit.model_dump_json(),
                one.plugin_files,
                arrays,
                self.topic,
                key=f"cembench-unit-{one.unit.key}-{uuid.uuid4().hex[:6]}",
                pure=False,
                **chosen,
            )
        flight.future = future
        self.flying[one.unit.key] = flight
        future.add_done_callback(lambda done: self.events.put(("done", (one.unit.key, done))))

    def _handle_next(self) -> None:
        try:
            what, about = self.events.get(timeout=LOOK_EVERY)
        except Empty:
            self._look()
            return
        if what == "event":
            self._event(about)
        else:
            key, future = about
            flight = self.flying.get(key)
            if flight is not None and flight.future is future:
                self._landed(flight, future)
        if monotonic() - self.looked > LOOK_EVERY:
            self._look()

    def _look(self) -> None:
        """Find the connected workers; raise if the scheduler cannot be reached."""
        self.looked = monotonic()
        if self.client.status != "running":
            raise self._gone()
        try:
            found = sorted(self.client.nthreads())
        except (OSError, TimeoutError) as error:
            raise self._gone() from error
        if found != self.workers:
            for worker in set(self.workers) - set(found):
                if worker in self.machines:
                    self.machines[worker].lost = True
            self.workers = found
            names = [self.machines[w].machine if w in self.machines else w for w in found]
            self.watcher.machines(names)
        if found:
            self.since = self.looked
        elif isinstance(self.client.cluster, LocalCluster) and (
            self.looked - self.since > LOCAL_PATIENCE
        ):
            raise ClusterError(
                f"all workers of this machine are gone, and none was started again within "
                f"{LOCAL_PATIENCE:g} s; {len(self.records)} finished cells are in "
                f"{self.store.folder}. See whether its memory suffices; the same command goes on."
            )
        elif self.looked - self.since > _PATIENCE and not self.told_alone:
            self.told_alone = True
            self.watcher.shows("no worker is there yet; waiting for one")
        self._save_state()

    def _gone(self) -> ClusterError:
        left = len(self.waiting) + len(self.flying)
        return ClusterError(
            f"the scheduler is gone; {len(self.records)} finished cells are in "
            f"{self.store.folder}, {left} surfaces are left. Start a scheduler and workers; the "
            "same command goes on."
        )

    def _event(self, about: Mapping[str, Any]) -> None:
        flight = self.flying.get(about["unit"])
        if flight is None:
            return
        if about["what"] == "takes":
            self._taken(flight, about["worker"], about["machine"])
            return
        task = flight.parcel.by_label.get(about.get("cell", ""))
        if about["what"] == "began":
            self._known(about["machine"], json.loads(about["environment"]))
        elif about["what"] == "queues":
            flight.doing = "waits for another worker of its machine"
        elif task is None:
            return
        elif about["what"] == "adds_rounds":
            self.watcher.adds_rounds(task, about["rounds"])
        else:
            step = Step(**about["step"])
            flight.doing = f"{step} of {task.cell.algorithm}"
            if about["what"] == "starts":
                self.watcher.starts(task, step)
            else:
                self.watcher.ends(task, step, about["seconds"])
        if flight.takers and flight.takers[-1] in self.machines:
            where = f"{flight.parcel.unit.mesh}: {flight.doing}" if flight.doing else ""
            self.machines[flight.takers[-1]].at = where or flight.parcel.unit.mesh

    def _known(self, machine: str, environment: dict[str, Any]) -> None:
        """Report once if the software of a machine differs from ours."""
        told = differences(self.environment, environment)
        if told and machine not in self.environments:
            self.watcher.shows(f"{machine} has other software: {'; '.join(told)}")
        self.environments[machine] = environment

    def _taken(self, flight: _Flight, worker: str, machine: str) -> None:
        """Record who measures a unit; give up a unit that has ended too many workers."""
        flight.takers.append(worker)
        flight.since = monotonic()
        self.machines.setdefault(worker, MachineState(machine=machine))
        if len(flight.takers) > 1:
            self._tell_again(flight, machine)
        flight.machine = machine
        if len(flight.takers) + flight.ended > MOST_LOST and flight.future is not None:
            future, flight.future = flight.future, None
            with suppress(Exception):
                self.client.cancel([future], force=True)
            self._give_up(flight)

    def _tell_again(self, flight: _Flight, machine: str) -> None:
        unit = flight.parcel.unit
        self.watcher.shows(
            f"{unit.mesh} ({unit.cells[0].solves}) is measured again on {machine}: the worker on "
            f"{flight.machine} was lost{f' in {flight.doing}' if flight.doing else ''}"
        )

    def _landed(self, flight: _Flight, future: Future) -> None:
        if future.status == "finished":
            self._take(flight, future.result())
        elif future.status in ("cancelled", "lost"):
            if self.client.status != "running":
                raise self._gone()
            self._send_again(flight)
        else:
            error = future.exception()
            if isinstance(error, KilledWorker):
                self._give_up(flight)
            elif isinstance(error, MeasurerGoneError):
                flight.ended += 1
                if flight.ended >= MOST_LOST:
                    self._give_up(flight)
                else:
                    self.watcher.shows(f"{flight.parcel.unit.mesh} is measured again: {error}")
                    flight.takers.clear()
                    self._send_again(flight)
            else:
                where = f" on {flight.machine}" if flight.machine else ""
                mesh = flight.parcel.unit.mesh
                raise ClusterError(f"{mesh} cannot be measured{where}: {error}") from error

    def _send_again(self, flight: _Flight) -> None:
        del self.flying[flight.parcel.unit.key]
        flight.sent_surface = False
        self.waiting.appendleft(flight)

    def _take(self, flight: _Flight, answer: Answer) -> None:
        """Save the records of a unit, or send what its worker asks for."""
        unit = flight.parcel.unit
        state = self.machines.setdefault(answer.address, MachineState(machine=answer.machine))
        state.machine, state.at = answer.machine, ""
        if answer.lacks_surface:
            flight.sent_surface = True
            self._submit(flight, answer.address)
            return
        if answer.refused:
            self._refuse(flight, answer)
            return
        tasks = {task.cell.key: task for task in flight.parcel.tasks}
        for signed, uv in answer.records:
            try:
                record = Record.model_validate_json(signed)
            except ValidationError as error:
                why = f"{answer.machine} sent a record that cannot be read"
                raise ClusterError(f"{why}: {error.errors()[0]['msg']}.") from error
            task = tasks.pop(record.cell.key, None)
            environment = (answer.environments or {}).get(record.environment)
            if task is not None and environment is not None:
                self.store.save(record, uv, environment)
                self._finish(task, record, kept=False)
        if tasks:
            raise ClusterError(f"{answer.machine} sent no record of {len(tasks)} cells; run again.")
        del self.flying[unit.key]
        state.units += 1
        self._done(flight)
        with suppress(Exception):  # it is deleted after some days anyway
            self.client.run(forget, [unit.key], workers=[answer.address], wait=False)

    def _done(self, flight: _Flight) -> None:
        self.state.done += 1
        self.expected += flight.parcel.seconds
        self.taken += monotonic() - flight.since
        self._save_state(at_once=True)

    def _seconds_left(self) -> float | None:
        """Return the ratio of the actual to the expected seconds of the finished units."""
        if not self.expected or not self.workers:
            return None
        slower = self.taken / self.expected
        left = [slower * one.parcel.seconds for one in self.waiting]
        now = monotonic()
        left += [
            max(0.0, slower * one.parcel.seconds - (now - one.since))
            for one in self.flying.values()
        ]
        names = {self.machines[w].machine if w in self.machines else w for w in self._usable()}
        return makespan(left, max(1, len(names)))

    def _save_state(self, *, at_once: bool = False) -> None:
        if at_once or monotonic() - self.saved > STATE_EVERY:
            self.saved = monotonic()
            self.state.machines = list(self.machines.values())
            self.state.seconds_left = self._seconds_left()
            save_state(self.store.folder, self.state)

    def _refuse(self, flight: _Flight, answer: Answer) -> None:
        self.refused.add(answer.address)
        told = f"{answer.machine} measures nothing: its software differs: {answer.refused}"
        self.watcher.shows(told)
        flight.takers.clear()
        self._send_again(flight)
        if not self._usable():
            raise ClusterError(
                f"no worker has the software of this machine ({answer.machine}: {answer.refused}). "
                "Install the same on the workers, or leave out --same-environment."
            )

    def _give_up(self, flight: _Flight) -> None:
        """Record the cells of a unit that ends every worker as failed."""
        machine = flight.machine or "a machine of the cluster"
        told = (
            f"its surface ended {MOST_LOST} workers that measured it, the last on {machine}"
            f"{f' in {flight.doing}' if flight.doing else ''}"
        )
        fault = Fault(kind=FaultKind.WORKERS_LOST, detail=told)
        environment = self.environments.get(flight.machine, self.environment)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        for task in flight.parcel.tasks:
            record = record_of(task, not_ok("failed", fault), environment["id"], now)
            self.store.save(record, None, environment)
            self._finish(task, record, kept=False)
        self.flying.pop(flight.parcel.unit.key, None)
        self._done(flight)

    def _finish(self, task: Task, record: Record, *, kept: bool) -> None:
        self.records[task.cell.label] = record
        self.watcher.finished(task, record, kept=kept)
