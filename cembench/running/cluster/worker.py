"""Measure a unit in a dask worker, and return its records.

A worker does what :func:`~cembench.running.local.run_tasks` does on one machine: algorithms are
called in processes of their own, which end with the worker.
"""

from __future__ import annotations

import hashlib
import os
import signal
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import dask
import psutil
from distributed import get_worker

from cembench.core.arrays import Complex
from cembench.core.atomic import write_bytes
from cembench.core.errors import CembenchError, ClusterError
from cembench.core.loading import is_there, read_bytes
from cembench.registry import Algorithm, load_algorithm
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.cluster import host
from cembench.running.cluster.units import Unit
from cembench.running.environment import importing, machine_name, usable_cores
from cembench.running.local import run_tasks
from cembench.running.plan import Task
from cembench.running.sources import hash_of, sources_of
from cembench.running.timing import CellTimer
from cembench.running.watcher import Step, Watcher


@dataclass(frozen=True)
class Answer:
    """The records of a unit: their files, each with its map, and the environments by id."""

    records: Sequence[tuple[bytes, Complex | None]]
    environments: Mapping[str, dict[str, Any]]


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C to the client; dask calls this in each local worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def measure_unit(unit: Unit, topic: str) -> Answer:
    """Measure a unit in a dask worker, and send events to the topic.

    Raises
    ------
    ClusterError
        This machine cannot measure the unit, or the unit was cancelled.
    """
    worker = get_worker()
    key = worker.get_current_task()

    def is_wanted() -> bool:
        state = worker.state.tasks.get(key)
        return state is not None and state.state in ("executing", "long-running")

    origin = {"unit": unit.key, "worker": worker.address}
    forwarder = Forwarder(lambda event: worker.log_event(topic, {**origin, **event}), is_wanted)
    _unset_dask_variables()
    with host.machine_lock(forwarder.waits):
        host.clear_old()
        store = Store(host.unit_folder(unit.key) / "run")
        try:
            measure(unit, store, forwarder)
        except CembenchError:
            raise
        except Exception:  # perhaps of a class that the client cannot unpickle
            raise ClusterError(traceback.format_exc()) from None
        files = [(cell, store.record_file(cell)) for cell in unit.cells]
        records = [(read_bytes(file), store.uv(cell)) for cell, file in files if is_there(file)]
        return Answer(records, store.environments())


async def forget(key: str) -> None:
    """Delete the files of a unit whose records the client has."""
    host.forget_unit(key)


class Cancelled(threading.Event):
    """An event that is set as soon as the client no longer waits for the unit."""

    def __init__(self, is_wanted: Callable[[], bool]) -> None:
        super().__init__()
        self.is_wanted = is_wanted

    def is_set(self) -> bool:
        """Whether it is set."""
        return super().is_set() or not self.is_wanted()


class Forwarder(Watcher):
    """Forwards the progress of a unit to the client, until the unit is cancelled."""

    def __init__(
        self, send: Callable[[Mapping[str, Any]], None], is_wanted: Callable[[], bool]
    ) -> None:
        self.send = send
        self.cancelled = Cancelled(is_wanted)

    def waits(self) -> None:
        """Forward that another worker of the machine measures; called every second."""
        self._forward("waits", None, at="waits for another worker of its machine")

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """Forward the event to the client."""
        self._forward("adds_rounds", task, rounds)

    def starts(self, task: Task, step: Step) -> None:
        """Forward the event to the client."""
        self._forward("starts", task, vars(step), at=f"{step} of {task.cell.algorithm}")

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """Forward the event; of a cancelled unit nothing is saved that was stopped."""
        self._forward("ends", task, vars(step), seconds)

    def _forward(self, what: str, task: Task | None, *about: Any, at: str = "") -> None:
        if self.cancelled.is_set():
            raise ClusterError("the unit was cancelled: its client does not wait for it any more.")
        cell = task.cell.label if task else ""
        self.send({"what": what, "cell": cell, "about": list(about), "at": at})


def measure(unit: Unit, store: Store, forwarder: Forwarder) -> list[Record]:
    """Measure a unit, or resume it if the store has a part of it; return its records.

    Raises
    ------
    ClusterError
        The surface arrived damaged, the machine has other code than the client, or the unit was
        cancelled.
    """
    plugins = tuple(_placed(name, files) for name, files in unit.plugins.items())
    for array in (unit.mesh.V, unit.mesh.F):
        array.setflags(write=False)
    tasks = []
    for cell in unit.cells:
        if unit.mesh.hash != cell.mesh_hash:
            raise ClusterError(f"the surface {cell.mesh} arrived damaged; run again.")
        algorithm = _algorithm(cell.algorithm, plugins)
        sources = sources_of(algorithm)
        if hash_of(sources) != cell.code_hash:
            raise ClusterError(
                f"{cell.algorithm} has other code on {machine_name()} than on the client: "
                f"{', '.join(sources)} differ. Install the same version of cembench and of "
                "plug-ins on all machines."
            )
        tasks.append(Task(cell, algorithm, unit.mesh, unit.facts, plugins, sources))
    free = int(0.9 * psutil.virtual_memory().available)
    options = replace(
        unit.options,
        memory_bytes=unit.options.memory_bytes or free,
        jobs=min(unit.options.jobs, usable_cores()),
    )
    return run_tasks(
        *(tasks, store, options, forwarder),
        lambda scratch, options: CellTimer(scratch, options, stopped=forwarder.cancelled),
    )


@cache
def _algorithm(name: str, plugins: tuple[str, ...]) -> Algorithm:
    """Return an algorithm, loaded once in a process: the folders of plug-ins change with them."""
    with importing():
        return load_algorithm(name, plugins)


def _placed(plugin: str, files: Mapping[str, bytes]) -> str:
    """Write the files of a plug-in to a folder named by their content; return its new name."""
    if not files:
        return plugin
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(f"{name} {len(content)} ".encode() + content)
    folder = host.place() / "plugins" / digest.hexdigest()[:24]
    for name, content in files.items():
        path = folder / name
        if not path.is_file() or read_bytes(path) != content:
            write_bytes(path, content)
    return str(folder / Path(plugin).name)


def _unset_dask_variables() -> None:
    """Unset the variables that dask set for this process, such as those of the allocator.

    Processes that measure would inherit them, and their seconds would differ from a local run's.
    """
    for name, value in dask.config.get("distributed.nanny.pre-spawn-environ", {}).items():
        if os.environ.get(name) == str(value):
            del os.environ[name]
