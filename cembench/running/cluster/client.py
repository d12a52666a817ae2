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
from concurrent.futures import CancelledError
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
from cembench.running.cluster.units import Unit, pack
from cembench.running.cluster.worker import Answer, forget, measure_unit
from cembench.running.environment import describe_environment
from cembench.running.estimate import estimate
from cembench.running.options import Options
from cembench.running.plan import Task, comparable_groups
from cembench.running.recorder import Recorder, now, record_of, recording
from cembench.running.watcher import Step, Watcher

#: Number of lost workers after which a unit is recorded as failed.
MAX_LOST = 2
#: Seconds between two looks at the connected workers.
POLL_SECONDS = 1.0
#: Seconds for the records of a unit to arrive.
ARRIVES_WITHIN = 600.0
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
    future: Any = None
    #: Number of workers that were lost with it, and what the last one did.
    lost: int = 0
    during: str = ""


@dataclass(eq=False)
class _Worker:
    """A worker, also after it was lost."""

    address: str
    environment: dict[str, Any]
    state: MachineState
    #: How its software differs; with `same_environment` such a worker gets no unit.
    differs: str = ""
    job: _Job | None = None

    @property
    def machine(self) -> str:
        return self.state.machine


@dataclass(eq=False)
class _ClusterRun:
    """One sitting: the units that wait, and those that workers have."""

    recorder: Recorder
    client: Client
    same_environment: bool
    topic: str = field(default_factory=lambda: f"cembench-{uuid.uuid4().hex[:12]}")
    #: What workers report, and their futures that are done.
    events: SimpleQueue[Mapping[str, Any] | tuple[_Worker, Future]] = field(
        default_factory=SimpleQueue
    )
    #: The longest last.
    waiting: list[_Job] = field(default_factory=list)
    #: By their addresses; a lost one stays.
    workers: dict[str, _Worker] = field(default_factory=dict)
    state: ClusterState = field(default_factory=lambda: ClusterState(units=0))
    since: float = field(default_factory=monotonic)
    #: When the workers were looked at, and when there was one.
    looked: float = 0.0
    met: float = field(default_factory=monotonic)
    #: Expected seconds of the units that are done.
    done: float = 0.0

    @property
    def watcher(self) -> Watcher:
        return self.recorder.watcher

    @property
    def sent(self) -> list[_Job]:
        """The units that workers have."""
        return [worker.job for worker in self.workers.values() if worker.job]

    def measure(self, pending: Sequence[Task]) -> None:
        if not pending:
            return
        self._look()
        if not self.workers:
            self.watcher.shows("no worker is connected yet; waiting for one")
        self.waiting = self._jobs(pending)
        self.state.units = len(self.waiting)
        rounds = next_look(0, self.recorder.options.most_rounds)
        self.watcher.begins(sum(1 + (task.cell.repeats or rounds) for task in pending))
        self.client.subscribe_topic(self.topic, lambda event: self.events.put(event[1]))
        while self.waiting or self.sent:
            for worker in self._connected():
                refused = self.same_environment and worker.differs
                if self.waiting and not worker.job and not refused:
                    self._send(worker, self.waiting.pop())
            with suppress(Empty):
                event = self.events.get(timeout=POLL_SECONDS)
                self._report(event) if isinstance(event, Mapping) else self._end(*event)
            if monotonic() - self.looked > POLL_SECONDS:
                self._look()
        self._save_state()

    def cancel(self) -> None:
        """Cancel the units that workers have; the workers notice it."""
        with suppress(Exception):  # the scheduler may be gone
            self.client.unsubscribe_topic(self.topic)
            if self.sent and self.client.status == "running":
                self.client.cancel([job.future for job in self.sent], force=True)

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
        share = (options.budget or 0.0) * max(1, len(self.workers)) / sum(costs.values())
        jobs = []
        for group in comparable_groups(pending):
            tasks = {task.cell.label: task for task in group}
            seconds = sum(costs[label] for label in tasks)
            own = replace(options, budget=None if options.budget is None else share * seconds)
            jobs.append(_Job(pack(group, token, own), tasks, seconds))
        return sorted(jobs, key=lambda job: job.seconds)

    def _send(self, worker: _Worker, job: _Job) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that the arrays are large
            job.future = self.client.submit(
                *(measure_unit, job.unit, self.topic),
                key=f"cembench-unit-{job.unit.key}-{uuid.uuid4().hex[:6]}",
                pure=False,
                workers=[worker.address],
            )
        worker.job, worker.state.at = job, job.unit.mesh.name
        job.future.add_done_callback(lambda done: self.events.put((worker, done)))

    def _report(self, event: Mapping[str, Any]) -> None:
        """Show what a worker reports of its unit."""
        worker = self.workers[event["worker"]]
        job = worker.job
        if job is None or job.unit.key != event["unit"]:
            return
        if event["at"]:
            job.during = f" in {event['at']}"
            worker.state.at = f"{job.unit.mesh.name}: {event['at']}"
        if event["cell"]:
            about = [Step(**one) if isinstance(one, dict) else one for one in event["about"]]
            getattr(self.watcher, event["what"])(job.tasks[event["cell"]], *about)

    def _end(self, worker: _Worker, future: Future) -> None:
        """Save the records of a unit that is done, unless it was taken back."""
        job = worker.job
        if job is None or future is not job.future:
            return
        error = future.exception() if future.status == "error" else None
        if error is not None and not isinstance(error, KilledWorker):
            name = job.unit.mesh.name
            raise ClusterError(f"{name} cannot be measured on {worker.machine}: {error}") from error
        try:
            answer = future.result(timeout=ARRIVES_WITHIN)
        except (OSError, TimeoutError, CancelledError, KilledWorker):  # its worker has just ended
            self._look()
            self._lose(worker)
        else:
            self._save(worker, job, answer)

    def _save(self, worker: _Worker, job: _Job, answer: Answer) -> None:
        missing = dict(job.tasks)
        for content, uv in answer.records:
            try:
                record = Record.model_validate_json(content)
                task = missing.pop(record.cell.label)
                environment = answer.environments[record.environment]
            except (KeyError, ValidationError) as error:
                raise ClusterError(
                    f"{worker.machine} sent a record that cannot be used: {error}. Install the "
                    "same version of cembench on all machines."
                ) from error
            self.recorder.save(task, record, uv, environment)
        if missing:
            raise ClusterError(f"{worker.machine} sent no record of {len(missing)} cells.")
        worker.state.units += 1
        self._count(worker, job)
        with suppress(Exception):  # it is deleted after some days anyway
            self.client.run(forget, job.unit.key, workers=[worker.address], wait=False)

    def _lose(self, worker: _Worker) -> None:
        """Take back the unit of a worker that is lost; give up one that has ended too many."""
        job = worker.job
        if job is None:
            return
        with suppress(Exception):
            self.client.cancel([job.future], force=True)
        job.lost += 1
        if job.lost >= MAX_LOST:
            self._give_up(worker, job)
            return
        worker.job = None
        self.waiting.append(job)
        self.watcher.shows(
            f"{job.unit.mesh.name} ({job.unit.cells[0].solves}) is measured again: the worker on "
            f"{worker.machine} was lost{job.during}"
        )

    def _give_up(self, worker: _Worker, job: _Job) -> None:
        """Record the cells of a unit that ended its workers as failed."""
        detail = (
            f"its surface ended {job.lost} workers that measured it, the last on "
            f"{worker.machine}{job.during}"
        )
        outcome = not_ok("failed", Fault(kind=FaultKind.WORKERS_LOST, detail=detail))
        for task in job.tasks.values():
            record = record_of(task, outcome, worker.environment["id"], now())
            self.recorder.save(task, record, None, worker.environment)
        self._count(worker, job)

    def _count(self, worker: _Worker, job: _Job) -> None:
        """Count a unit as done."""
        worker.job, worker.state.at = None, ""
        self.done += job.seconds
        self.state.done += 1
        self._save_state()

    def _save_state(self) -> None:
        """Save the progress; what is left takes as long for an expected second as what is done."""
        left = sum(job.seconds for job in (*self.waiting, *self.sent))
        self.state.machines = [worker.state for worker in self.workers.values()]
        pace = (monotonic() - self.since) / self.done if self.done else None
        self.state.seconds_left = pace and pace * left
        save_state(self.recorder.store.folder, self.state)

    def _look(self) -> None:
        """Update the workers, and check that the run can go on.

        Raises
        ------
        ClusterError
            The scheduler cannot be reached, or no worker is left that can measure.
        """
        self.looked = monotonic()
        before = self._connected()
        try:
            if self.client.status != "running":
                raise OSError(self.client.status)
            there = self.client.nthreads().keys()
            self._add_workers(sorted(there - {worker.address for worker in before}))
        except (OSError, TimeoutError) as error:
            raise ClusterError(
                f"the scheduler is gone; {self._finished}, {len(self.waiting) + len(self.sent)} "
                "surfaces are left. Start a scheduler and workers; the same command goes on."
            ) from error
        for worker in self._connected():
            if worker.address not in there:
                worker.state.lost = True
                self._lose(worker)
        connected = self._connected()
        if connected != before:
            self.watcher.machines([worker.machine for worker in connected])
        self._check_workers(connected)
        self._save_state()

    def _connected(self) -> list[_Worker]:
        return [worker for worker in self.workers.values() if not worker.state.lost]

    def _add_workers(self, new: Sequence[str]) -> None:
        """Describe new workers; show once a machine if its software differs from the client's."""
        if not new:
            return
        answers = self.client.run(describe_environment, workers=new, on_error="return")
        for address, environment in answers.items():
            if isinstance(environment, OSError):  # it is gone again
                continue
            if isinstance(environment, Exception):
                raise ClusterError(
                    f"the worker {address} cannot measure: {environment}. Install the same version "
                    "of cembench on all machines."
                )
            machine = environment["machine"]
            differs = "; ".join(differences(self.recorder.environment, environment))
            if differs and all(one.machine != machine for one in self.workers.values()):
                refused = "measures nothing: its software differs"
                how = refused if self.same_environment else "has other software"
                self.watcher.shows(f"{machine} {how}: {differs}")
            state = MachineState(machine=machine)
            self.workers[address] = _Worker(address, environment, state, differs)

    def _check_workers(self, connected: Sequence[_Worker]) -> None:
        """Raise :class:`ClusterError` if no worker measures, and none is to be expected."""
        if self.same_environment and connected and all(one.differs for one in connected):
            raise ClusterError(
                "no worker has the software of this machine "
                f"({connected[-1].machine}: {connected[-1].differs}). Install the same on the "
                "workers, or leave out `same_environment`."
            )
        cluster, alone = self.client.cluster, self.looked - self.met
        if connected:
            self.met = self.looked
        elif isinstance(cluster, LocalCluster) and alone > LOCAL_PATIENCE:
            raise ClusterError(
                f"all workers of this machine are gone, and none was restarted within "
                f"{LOCAL_PATIENCE:g} s; {self._finished}. Check whether the memory suffices; "
                "the same command goes on."
            )
        elif (refused := refusals(cluster)) and len(refused) >= len(cluster.worker_spec):
            raise ClusterError(
                f"Slurm takes no job: {refused[-1]}; {self._finished}. Correct the settings in "
                "`cluster`; the same command goes on."
            )

    @property
    def _finished(self) -> str:
        return f"{len(self.recorder.records)} finished cells are in {self.recorder.store.folder}"
