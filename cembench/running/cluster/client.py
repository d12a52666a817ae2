"""Run cells on a cluster: send units to workers, and save their records in the run's folder.

Dask starts what is sent to a worker, and answers. Each connected worker has one unit at a time, so
a worker that is lost had one unit, and no other is suspected of having ended it; this client sends
that unit to another worker.
"""

from __future__ import annotations

import uuid
import warnings
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from distributed import Client, Future, KilledWorker, LocalCluster
from distributed.client import FutureCancelledError
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
from cembench.running.cluster.units import Unit, pack
from cembench.running.cluster.worker import Answer, forget, measure_unit
from cembench.running.environment import describe_environment
from cembench.running.estimate import estimate
from cembench.running.options import Options
from cembench.running.plan import Task, comparable_groups
from cembench.running.recorder import Recorder, now, record_of, recording
from cembench.running.watcher import Step, Watcher

#: Number of lost workers after which a unit is recorded as failed.
MOST_LOST = 2
#: Seconds between two looks at the connected workers.
LOOK_EVERY = 1.0
#: Seconds for the records of a unit to arrive.
ARRIVES_WITHIN = 600.0
#: Seconds without any worker before a message says so.
_PATIENCE = 5.0
#: Seconds without any worker after which a run on this machine's own workers ends: dask restarts
#: them, but only so often. On other clusters, workers can join at any time.
LOCAL_PATIENCE = 120.0


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


@dataclass(eq=False)
class _Job:
    """A unit that waits, or that a worker has."""

    unit: Unit
    tasks: Mapping[str, Task]
    #: As expected.
    seconds: float
    future: Future | None = None
    #: Number of workers that were lost with it, and what the last one did.
    lost: int = 0
    activity: str = ""

    @property
    def during(self) -> str:
        """The activity, to be appended to a message."""
        return f" in {self.activity}" if self.activity else ""


@dataclass(eq=False)
class _ClusterRun:
    """One sitting: the units that wait, and those that workers have."""

    recorder: Recorder
    client: Client
    same_environment: bool
    topic: str = field(default_factory=lambda: f"cembench-{uuid.uuid4().hex[:12]}")
    #: What workers report, and futures that are done.
    events: SimpleQueue[Mapping[str, Any] | Future] = field(default_factory=SimpleQueue)
    #: The longest last.
    waiting: list[_Job] = field(default_factory=list)
    #: By the addresses of workers, as all below.
    working: dict[str, _Job] = field(default_factory=dict)
    connected: list[str] = field(default_factory=list)
    machines: dict[str, MachineState] = field(default_factory=dict)
    environments: dict[str, dict[str, Any]] = field(default_factory=dict)
    #: How the software of those differs that get no unit.
    refused: dict[str, str] = field(default_factory=dict)
    state: ClusterState = field(default_factory=lambda: ClusterState(units=0))
    since: float = field(default_factory=monotonic)
    #: When the workers were looked at, and when there was one.
    looked: float = 0.0
    met: float = field(default_factory=monotonic)
    reported_alone: bool = False
    #: Expected seconds of the units that are done.
    done: float = 0.0

    @property
    def watcher(self) -> Watcher:
        return self.recorder.watcher

    def measure(self, pending: Sequence[Task]) -> None:
        if not pending:
            return
        self._look()
        self.waiting = self._jobs(pending)
        self.state.units = len(self.waiting)
        rounds = next_look(0, self.recorder.options.most_rounds)
        self.watcher.begins(sum(1 + (task.cell.repeats or rounds) for task in pending))
        self.client.subscribe_topic(self.topic, lambda event: self.events.put(event[1]))
        while self.waiting or self.working:
            for worker in self.connected:
                if self.waiting and worker not in self.working and worker not in self.refused:
                    self._send(worker, self.waiting.pop())
            with suppress(Empty):
                event = self.events.get(timeout=LOOK_EVERY)
                self._report(event) if isinstance(event, Mapping) else self._end(event)
            if monotonic() - self.looked > LOOK_EVERY:
                self._look()
        self._save_state()

    def cancel(self) -> None:
        """Cancel the units that workers have; the workers notice it."""
        with suppress(Exception):  # the scheduler may be gone
            self.client.unsubscribe_topic(self.topic)
            if self.working and self.client.status == "running":
                self.client.cancel([job.future for job in self.working.values()], force=True)

    def _jobs(self, pending: Sequence[Task]) -> list[_Job]:
        """Pack the units, the longest last: sent at the end, it would keep the others waiting."""
        options = self.recorder.options
        token = run_folder.claim(self.recorder.store.folder).token or ""
        if options.fresh or options.rerun_failed:
            token += self.topic  # unfinished units of earlier runs are not resumed
        known = defaultdict[str, list[Record]](list)
        for record in verify(self.recorder.store, Depth.records).records:
            known[record.cell.algorithm].append(record)
        costs = {
            t.cell.label: estimate(t.cell, t.facts.faces, known[t.cell.algorithm]).seconds
            for t in pending
        }
        # Per expected second, so that all units are cut by the same factor.
        share = (options.budget or 0.0) * max(1, len(self.connected)) / sum(costs.values())
        jobs = []
        for group in comparable_groups(pending):
            tasks = {task.cell.label: task for task in group}
            seconds = sum(costs[label] for label in tasks)
            own = replace(options, budget=None if options.budget is None else share * seconds)
            jobs.append(_Job(pack(group, token, own), tasks, seconds))
        return sorted(jobs, key=lambda job: job.seconds)

    def _send(self, worker: str, job: _Job) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that the arrays are large
            key = f"cembench-unit-{job.unit.key}-{uuid.uuid4().hex[:6]}"
            job.future = self.client.submit(
                *(measure_unit, job.unit, self.topic), key=key, pure=False, workers=[worker]
            )
        self.working[worker] = job
        self.machines[worker].at = job.unit.mesh.name
        job.future.add_done_callback(self.events.put)

    def _report(self, event: Mapping[str, Any]) -> None:
        """Show what a worker reports of its unit."""
        job = self.working.get(event["worker"])
        if job is None or job.unit.key != event["unit"]:
            return
        if event["what"] == "waits":
            job.activity = "waits for another worker of its machine"
        elif event["what"] == "adds_rounds":
            self.watcher.adds_rounds(job.tasks[event["cell"]], event["rounds"])
        else:
            task, step = job.tasks[event["cell"]], Step(**event["step"])
            job.activity = f"{step} of {task.cell.algorithm}"
            if event["what"] == "starts":
                self.watcher.starts(task, step)
            else:
                self.watcher.ends(task, step, event["seconds"])
        self.machines[event["worker"]].at = f"{job.unit.mesh.name}: {job.activity}"

    def _end(self, future: Future) -> None:
        """Save the records of a unit that is done."""
        worker = next((w for w, job in self.working.items() if job.future is future), "")
        if not worker:  # it was sent to another worker
            return
        if future.status == "error":
            error = future.exception()
            if isinstance(error, KilledWorker):
                self._give_up(worker, error.allowed_failures + 1)
                return
            mesh, machine = self.working[worker].unit.mesh, self.machines[worker].machine
            raise ClusterError(f"{mesh.name} cannot be measured on {machine}: {error}") from error
        try:
            answer = future.result(timeout=ARRIVES_WITHIN)
        except (OSError, TimeoutError, FutureCancelledError):  # its worker has just ended
            self._look()
            if worker in self.working:
                self._lose(worker)
        else:
            self._save(worker, answer)

    def _save(self, worker: str, answer: Answer) -> None:
        job, machine = self.working[worker], self.machines[worker]
        missing = dict(job.tasks)
        for content, uv in answer.records:
            try:
                record = Record.model_validate_json(content)
                task = missing.pop(record.cell.label)
                environment = answer.environments[record.environment]
            except (KeyError, ValidationError) as error:
                raise ClusterError(
                    f"{machine.machine} sent a record that cannot be used: {error}. Install the "
                    "same version of cembench on all machines."
                ) from error
            self.recorder.save(task, record, uv, environment)
        if missing:
            raise ClusterError(
                f"{machine.machine} sent no record of {len(missing)} cells; run again."
            )
        machine.units += 1
        self._count(worker)
        with suppress(Exception):  # it is deleted after some days anyway
            self.client.run(forget, job.unit.key, workers=[worker], wait=False)

    def _lose(self, worker: str) -> None:
        """Take back the unit of a worker that is lost; give up one that has ended too many."""
        job = self.working[worker]
        future, job.future = job.future, None
        with suppress(Exception):
            self.client.cancel([future], force=True)
        job.lost += 1
        if job.lost >= MOST_LOST:
            self._give_up(worker, job.lost)
            return
        self.waiting.append(self.working.pop(worker))
        self.watcher.shows(
            f"{job.unit.mesh.name} ({job.unit.cells[0].solves}) is measured again: the worker on "
            f"{self.machines[worker].machine} was lost{job.during}"
        )

    def _give_up(self, worker: str, lost: int) -> None:
        """Record the cells of a unit that ended its workers as failed."""
        job, environment = self.working[worker], self.environments[worker]
        detail = (
            f"its surface ended {lost} workers that measured it, the last on "
            f"{self.machines[worker].machine}{job.during}"
        )
        outcome = not_ok("failed", Fault(kind=FaultKind.WORKERS_LOST, detail=detail))
        for task in job.tasks.values():
            record = record_of(task, outcome, environment["id"], now())
            self.recorder.save(task, record, None, environment)
        self._count(worker)

    def _count(self, worker: str) -> None:
        """Count the unit of a worker as done."""
        self.machines[worker].at = ""
        self.done += self.working.pop(worker).seconds
        self.state.done += 1
        self._save_state()

    def _save_state(self) -> None:
        """Save the progress; what is left takes as long for an expected second as what is done."""
        left = sum(job.seconds for job in (*self.waiting, *self.working.values()))
        self.state.machines = list(self.machines.values())
        if self.done and self.connected:
            self.state.seconds_left = (monotonic() - self.since) / self.done * left
        save_state(self.recorder.store.folder, self.state)

    def _look(self) -> None:
        """Update the connected workers, and check that the run can go on.

        Raises
        ------
        ClusterError
            The scheduler cannot be reached, or no worker is left that can measure.

        """
        self.looked = monotonic()
        try:
            if self.client.status != "running":
                raise OSError(self.client.status)
            there = set(self.client.nthreads())
            if new := sorted(there - self.environments.keys()):
                self._add_workers(new)
        except (OSError, TimeoutError) as error:
            left = len(self.waiting) + len(self.working)
            raise ClusterError(
                f"the scheduler is gone; {self._finished}, {left} surfaces are left. Start a "
                "scheduler and workers; the same command goes on."
            ) from error
        there &= self.environments.keys()
        for worker in set(self.connected) - there:
            self.machines[worker].lost = True
            if worker in self.working:
                self._lose(worker)
        if self.connected != sorted(there):
            self.connected = sorted(there)
            self.watcher.machines([self.machines[worker].machine for worker in self.connected])
        if there and there <= self.refused.keys():
            raise ClusterError.about(
                "no worker has the software of this machine ({differing}). Install the same on the "
                "workers, or leave out {same_environment}.",
                differing=self.refused[self.connected[-1]],
            )
        if there:
            self.met = self.looked
        else:
            self._check_alone(self.looked - self.met)
        self._save_state()

    def _add_workers(self, new: Sequence[str]) -> None:
        """Describe new workers; show once a machine if its software differs from the client's."""
        answers = self.client.run(describe_environment, workers=new, on_error="return")
        for worker, environment in answers.items():
            if isinstance(environment, OSError):  # it is gone again
                continue
            if isinstance(environment, Exception):
                raise ClusterError(
                    f"the worker {worker} cannot measure: {environment}. Install the same version "
                    "of cembench on all machines."
                )
            machine = environment["machine"]
            is_new = all(state.machine != machine for state in self.machines.values())
            self.machines[worker] = MachineState(machine=machine)
            self.environments[worker] = environment
            others = "; ".join(differences(self.recorder.environment, environment))
            if others and self.same_environment:
                self.refused[worker] = f"{machine}: {others}"
                self.watcher.shows(f"{machine} measures nothing: its software differs: {others}")
            elif others and is_new:
                self.watcher.shows(f"{machine} has other software: {others}")

    def _check_alone(self, seconds: float) -> None:
        """Raise :class:`ClusterError` if no worker is there, and none is to be expected."""
        cluster = self.client.cluster
        if isinstance(cluster, LocalCluster) and seconds > LOCAL_PATIENCE:
            raise ClusterError(
                f"all workers of this machine are gone, and none was restarted within "
                f"{LOCAL_PATIENCE:g} s; {self._finished}. Check whether the memory suffices; "
                "the same command goes on."
            )
        refused = refusals(cluster)
        if refused and len(refused) >= len(cluster.worker_spec):
            raise ClusterError.about(
                "Slurm takes no job: {cause}; {kept}. Correct the settings in {cluster}; the same "
                "command goes on.",
                cause=refused[-1],
                kept=self._finished,
            )
        if seconds > _PATIENCE and not self.reported_alone:
            self.reported_alone = True
            self.watcher.shows("no worker is connected yet; waiting for one")

    @property
    def _finished(self) -> str:
        return f"{len(self.recorder.records)} finished cells are in {self.recorder.store.folder}"
