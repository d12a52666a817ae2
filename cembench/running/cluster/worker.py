"""Measure units in a dask worker, and return their records.

A worker does what :func:`~cembench.running.local.run_tasks` does on one machine: algorithms are
called in processes of their own, which end with the worker. A thread looks whether the client still
waits for the unit, and stops the process that runs if it does not.
"""

from __future__ import annotations

import hashlib
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import dask
import numpy as np
import psutil
from distributed import get_worker
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes
from cembench.core.errors import CembenchError, ClusterError
from cembench.core.loading import is_there, read_bytes
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, load_algorithm
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.cluster import host
from cembench.running.cluster.units import PluginFiles, Unit
from cembench.running.environment import describe_environment, importing, machine_name, usable_cores
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.sources import hash_of, sources_of
from cembench.running.timing import CellTimer
from cembench.running.watcher import Step, Watcher
from cembench.running.worker import MESH_TYPES

LOOK_EVERY = 1.0
#: The folder of the unit's own run, in the unit's folder.
RUN = "run"
Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]
#: Sends an event to the client.
Send = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True)
class Answer:
    """The records of a unit."""

    #: The address of the worker.
    worker: str
    #: The files of the records, each with its map.
    records: Sequence[tuple[bytes, NDArray[np.complex128] | None]] = ()
    #: By their ids.
    environments: Mapping[str, dict[str, Any]] = field(default_factory=dict)


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C to the client; dask calls this in each local worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def measure_unit(text: str, plugins: PluginFiles, surface: Arrays, topic: str) -> Answer:
    """Measure a unit, given as JSON, and send events to the topic; run by a dask worker.

    `surface` is V and F of the unit's surface.

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

    unit = Unit.model_validate_json(text)
    origin = {"unit": unit.key, "worker": worker.address}
    forwarder = Forwarder(lambda event: worker.log_event(topic, {**origin, **event}))
    _unset_dask_variables()
    with _cancelling(forwarder.cancelled, is_wanted), host.machine_lock(forwarder.waits):
        host.clear_old()
        try:
            mesh = surface_of(unit, surface)
            forwarder.send({"what": "takes"})
            placed = unit.model_copy(update={"plugins": _placed(unit.plugins, plugins)})
            store = Store(host.unit_folder(unit.key) / RUN)
            measure(placed, mesh, store, forwarder)
        except CembenchError:
            raise
        except Exception:  # perhaps of a class that the client cannot unpickle
            raise ClusterError(traceback.format_exc()) from None
        files = [(cell, store.record_file(cell)) for cell in unit.cells]
        records = [(read_bytes(file), store.uv(cell)) for cell, file in files if is_there(file)]
        return Answer(worker.address, records, store.environments())


def describe_worker() -> dict[str, Any]:
    """Return the environment of this worker, with the libraries loaded that measure."""
    return describe_environment()


async def forget(key: str) -> None:
    """Delete the files of a unit whose records the client has."""
    host.forget_unit(key)


class Forwarder(Watcher):
    """Forwards the progress of a unit to the client, until the unit is cancelled."""

    def __init__(self, send: Send) -> None:
        self.send = send
        self.cancelled = threading.Event()

    def waits(self) -> None:
        """Forward that another worker of the machine measures; called every second."""
        self._forward("queues")

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """Forward the event to the client."""
        self._forward("adds_rounds", cell=task.cell.label, rounds=rounds)

    def starts(self, task: Task, step: Step) -> None:
        """Forward the event to the client."""
        self._forward("starts", cell=task.cell.label, step=vars(step))

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """Forward the event; of a cancelled unit nothing is saved that was stopped."""
        self._forward("ends", cell=task.cell.label, step=vars(step), seconds=seconds)

    def _forward(self, what: str, **about: Any) -> None:
        if self.cancelled.is_set():
            raise ClusterError("the unit was cancelled: its client does not wait for it any more.")
        self.send({"what": what, **about})


@contextmanager
def _cancelling(cancelled: threading.Event, is_wanted: Callable[[], bool]) -> Iterator[None]:
    """Set the event as soon as the client cancels the unit that is measured in this block."""
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(LOOK_EVERY):
            if not is_wanted():
                cancelled.set()
                return

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def measure(unit: Unit, mesh: TriangleMesh, store: Store, forwarder: Forwarder) -> list[Record]:
    """Measure a unit, or resume it if the store has a part of it; return its records.

    Raises
    ------
    ClusterError
        The machine has other code than the client, or the unit was cancelled.

    """
    tasks = []
    for cell in unit.cells:
        algorithm = _algorithm(cell.algorithm, unit.plugins)
        sources = sources_of(algorithm)
        if hash_of(sources) != cell.code_hash:
            raise ClusterError(
                f"{cell.algorithm} has other code on {machine_name()} than on the client: "
                f"{', '.join(sources)} differ. Install the same version of cembench and of "
                "plug-ins on all machines."
            )
        tasks.append(Task(cell, algorithm, mesh, unit.facts, unit.plugins, sources))

    def timer(scratch: Path, options: Options) -> CellTimer:
        return CellTimer(scratch, options, stopped=forwarder.cancelled)

    return run_tasks(tasks, store, _options(unit), forwarder, timer)


@cache
def _algorithm(name: str, plugins: tuple[str, ...]) -> Algorithm:
    """Return an algorithm, loaded once in a process: the folders of plug-ins change with them."""
    with importing():
        return load_algorithm(name, plugins)


def _options(unit: Unit) -> Options:
    """Return the options of the run, bounded by the memory and the cores of this machine."""
    options = unit.run_options()
    free = int(0.9 * psutil.virtual_memory().available)
    jobs = min(options.jobs, usable_cores())
    return replace(options, memory_bytes=options.memory_bytes or free, jobs=jobs)


def surface_of(unit: Unit, arrays: Arrays) -> TriangleMesh:
    """Return the surface of a unit from V and F as they arrived.

    Raises
    ------
    ClusterError
        They are not those of the unit's surface, to the last bit.

    """
    mesh = MESH_TYPES[unit.mesh_type].trusted(*arrays, unit.mesh, unit.notices)
    if mesh.hash != unit.mesh_hash:
        raise ClusterError(f"the surface {unit.mesh} arrived damaged; run again.")
    mesh.V.setflags(write=False)
    mesh.F.setflags(write=False)
    return mesh


def _placed(plugins: tuple[str, ...], files: PluginFiles) -> tuple[str, ...]:
    """Write the files of plug-ins to a folder named by their content; return the new names."""
    placed = []
    for plugin in plugins:
        if plugin not in files:
            placed.append(plugin)
            continue
        digest = hashlib.sha256()
        for name, content in sorted(files[plugin].items()):
            digest.update(f"{name} {len(content)} ".encode() + content)
        folder = host.place() / "plugins" / digest.hexdigest()[:24]
        for name, content in files[plugin].items():
            path = folder / name
            if not path.is_file() or read_bytes(path) != content:
                write_bytes(path, content)
        placed.append(str(folder / Path(plugin).name))
    return tuple(placed)


def _unset_dask_variables() -> None:
    """Unset the variables that dask set for this process, such as those of the allocator.

    Processes that measure would inherit them, and their seconds would differ from a local run's.
    """
    for name, value in dask.config.get("distributed.nanny.pre-spawn-environ", {}).items():
        if os.environ.get(name) == str(value):
            del os.environ[name]
