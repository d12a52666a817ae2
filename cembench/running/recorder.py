"""Save the records of a run, measured on this machine or on a cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cembench.core.arrays import Complex
from cembench.results.records import Outcome, Record
from cembench.results.store import Store
from cembench.running.environment import describe_environment
from cembench.running.external.installed import external_of
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.watcher import Watcher


@dataclass
class Recorder:
    """Saves the records of a run, and reports each to the watcher."""

    store: Store
    options: Options
    watcher: Watcher
    #: Of this machine.
    environment: dict[str, Any]
    #: The folder for exchanging files with processes.
    scratch: Path
    #: By the cells' labels.
    records: dict[str, Record] = field(default_factory=dict)

    def pending(self, tasks: Sequence[Task]) -> list[Task]:
        """Report the records that the store has; return the tasks that are to be measured."""
        asked = {task.cell.label for task in tasks}
        pending = []
        for task in tasks:
            stored = self._stored(task, asked)
            if stored is None:
                pending.append(task)
            else:
                self._finish(task, stored, kept=True)
        return pending

    def _stored(self, task: Task, asked: set[str]) -> Record | None:
        """Return the valid record, if any; delete the samples of a cell that is measured again.

        A record follows its mesh to another name, unless the old one is `asked` for too.
        """
        # A damaged record stops a run, but not one that makes it anew.
        stored = None if self.options.fresh else self.store.find(task.cell)
        if stored is not None or self.options.fresh:
            self.store.forget_samples(task.cell)
        if stored is None or self.options.measures_again(stored):
            return None
        if stored.cell.label != task.cell.label:
            return self.store.rename(stored, task.cell, keep=stored.cell.label in asked)
        return stored

    def save(
        self,
        task: Task,
        record: Record,
        uv: Complex | None,
        environment: dict[str, Any] | None = None,
    ) -> None:
        """Save a record with its map, measured in this environment (default: this machine)."""
        self.store.save(record, uv, environment or self.environment)
        self._finish(task, record, kept=False)

    def _finish(self, task: Task, record: Record, *, kept: bool) -> None:
        self.records[task.cell.label] = record
        self.watcher.finished(task, record, kept=kept)


@contextmanager
def recording(
    tasks: Sequence[Task],
    store: Store,
    options: Options | None,
    watcher: Watcher | None,
    environment: dict[str, Any] | None = None,
) -> Iterator[Recorder]:
    """Hold the lock of a run's folder, and yield what saves records of these tasks there.

    A second run into the same folder waits for the first. `environment` is this machine's, where
    the caller has just described it.
    """
    options, watcher = options or Options(), watcher or Watcher()
    with store.locked(watcher.waits) as scratch:
        store.save_plan([task.cell for task in tasks])
        for mesh in {task.cell.mesh_hash: task.mesh for task in tasks}.values():
            store.save_mesh(mesh)
        yield Recorder(store, options, watcher, environment or describe_environment(), scratch)


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


def now() -> str:
    """Return the time in the form of records (UTC, to the second)."""
    return datetime.now(UTC).isoformat(timespec="seconds")
