"""A dask worker: it measures a unit in a separate process and returns the records."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import IO, Any

import dask
import numpy as np
from distributed import get_worker
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes, write_text
from cembench.core.errors import CembenchError, ClusterError
from cembench.core.loading import is_there, read_bytes
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.cluster import host
from cembench.running.cluster.measure import RUN, UNIT
from cembench.running.cluster.units import PluginFiles, Unit
from cembench.running.environment import machine_name
from cembench.running.surfaces import generate_surface

#: Seconds between two looks whether anybody still wants the unit.
LOOK_EVERY = 1.0
#: Seconds between two messages of what happens: what comes between them travels together.
TELL_EVERY = 0.05
#: A record's file, and its map.
Found = tuple[bytes, NDArray[np.complex128] | None]

#: Takes what happened since it was last called.
Tell = Callable[[Sequence[Mapping[str, Any]]], None]
#: What a process tells last of a unit.
_ENDS = ("done", "refused", "failed", "gone")

_one_unit = threading.Lock()


@dataclass(frozen=True)
class Answer:
    """The records of a unit, or the reason why this machine does not measure it."""

    machine: str
    address: str
    records: tuple[Found, ...] = ()
    environments: Mapping[str, dict[str, Any]] | None = None
    #: The surface is not here and cannot be generated: send the unit again, with it.
    lacks_surface: bool = False
    #: In what the software differs, where it must not.
    refused: str = ""


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C to the client; dask calls this in each local worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def measure_unit(
    text: str, plugins: PluginFiles, surface: host.Arrays | None, topic: str
) -> Answer:
    """Measure a unit; a worker has one at a time. Events go to the topic.

    Raises
    ------
    ClusterError
        It cannot be measured here, whatever is sent; or nobody wants it any more.

    """
    worker = get_worker()
    key = worker.get_current_task()

    def tell(events: Sequence[Mapping[str, Any]]) -> None:
        about = {"unit": unit_key, "machine": machine_name(), "events": list(events)}
        worker.log_event(topic, about)

    def is_wanted() -> bool:
        state = worker.state.tasks.get(key)
        return state is not None and state.state in ("executing", "long-running")

    unit = Unit.model_validate_json(text)
    unit_key = unit.key
    with _one_unit:
        about = (machine_name(), worker.address)
        host.clear_old()
        if not _has_surface(unit, surface):
            return Answer(*about, lacks_surface=True)
        folder = host.unit_folder(unit_key)
        placed = unit.model_copy(update={"plugins": _placed(unit.plugins, plugins)})
        write_text(folder / UNIT, placed.model_dump_json())
        tell([{"what": "takes", "worker": worker.address}])
        refused = _measurer().measure(unit_key, tell, is_wanted)
        if refused:
            return Answer(*about, refused=refused)
        store = Store(folder / RUN)
        return Answer(*about, _found(store, unit), store.environments())


async def forget(keys: list[str]) -> None:
    """Delete the files of units whose records the client has; the result is not awaited."""
    host.forget_units(keys)


def _found(store: Store, unit: Unit) -> tuple[Found, ...]:
    """Return the records of a unit as they lie on disk, with their maps."""
    files = [(cell, store.record_file(cell)) for cell in unit.cells]
    return tuple((read_bytes(file), store.uv(cell)) for cell, file in files if is_there(file))


def _has_surface(unit: Unit, sent: host.Arrays | None) -> bool:
    """Make the surface available: stored before, sent, or generated."""
    if host.kept_surface(unit.mesh_hash) is not None:
        return True
    arrays = sent or _generated(unit)
    if arrays is not None:
        host.keep_surface(unit.mesh_hash, arrays)
    return arrays is not None


def _generated(unit: Unit) -> host.Arrays | None:
    """Generate a registered surface, unless that takes longer than sending it.

    Another surface of the same name, or one that differs in a bit on this machine, is none.
    """
    registry = load_registry()
    family = registry.surfaces.get(unit.mesh)
    if family is None or family.kept is not None:
        return None
    try:
        made: TriangleMesh = generate_surface(registry, unit.mesh, unit.faces)
    except CembenchError:  # its data, or a library, are not on this machine
        return None
    return (made.V, made.F) if made.hash == unit.mesh_hash else None


def _placed(named: tuple[str, ...], files: PluginFiles) -> tuple[str, ...]:
    """Write the files of plug-ins, once per content; return the names of the plug-ins here."""
    here = []
    for plugin in named:
        if plugin not in files:
            here.append(plugin)
            continue
        digest = hashlib.sha256()
        for name, content in sorted(files[plugin].items()):
            digest.update(f"{name} {len(content)} ".encode() + content)
        folder = host.place() / "plugins" / digest.hexdigest()[:24]
        for name, content in files[plugin].items():
            path = folder / name
            if not path.is_file() or read_bytes(path) != content:
                write_bytes(path, content)
        here.append(str(folder / Path(plugin).name))
    return tuple(here)


class Measurer:
    """The measuring process, started once per worker, and again after it has ended."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cembench.running.cluster.measure"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
            text=True,
            start_new_session=True,  # Ctrl-C is the client's
        )
        self.lines: SimpleQueue[str | None] = SimpleQueue()
        threading.Thread(target=self._read, args=(self.process.stdout,), daemon=True).start()

    def _read(self, stream: IO[str]) -> None:
        for line in stream:
            self.lines.put(line)
        self.lines.put(None)

    def measure(self, key: str, tell: Tell, is_wanted: Callable[[], bool]) -> str:
        """Measure a unit; return why it is refused, or nothing. Ends if it is cancelled."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(key + "\n")
            self.process.stdin.flush()
        except OSError as error:
            raise MeasurerGoneError(f"the process that measures ended before: {error}") from error
        untold: list[Mapping[str, Any]] = []
        told, looked = -inf, monotonic()
        while True:
            event = self._next(told + TELL_EVERY if untold else looked + LOOK_EVERY)
            ended = event is not None and event["what"] in _ENDS
            if event is not None and not ended:
                untold.append(event)
            now = monotonic()
            if untold and (ended or now >= told + TELL_EVERY):
                tell(untold)
                untold, told = [], now
            if event is not None and ended:
                return self._why(event)
            if now >= looked + LOOK_EVERY:
                looked = now
                if not is_wanted():
                    self.close()
                    raise ClusterError("nobody waits for this unit any more.")

    def _next(self, until: float) -> Mapping[str, Any] | None:
        """Return what the process tells next; None where it tells nothing until then."""
        try:
            line = self.lines.get(timeout=max(0.0, until - monotonic()))
        except Empty:
            return None
        return {"what": "gone"} if line is None else dict(json.loads(line))

    def _why(self, event: Mapping[str, Any]) -> str:
        """Return why a unit is refused, or nothing; raise where it could not be measured."""
        if event["what"] == "gone":
            code = self.process.wait()
            raise MeasurerGoneError(f"the process that measures ended with code {code}")
        if event["what"] == "failed":
            raise ClusterError(event["why"])
        return str(event.get("why", ""))

    def close(self) -> None:
        """End the process and everything it started."""
        self.process.kill()
        self.process.wait()


class MeasurerGoneError(Exception):
    """The measuring process ended without an answer."""


_measurers: list[Measurer] = []


def _measurer() -> Measurer:
    """Return the measuring process; start one if there is none."""
    if _measurers and _measurers[0].process.poll() is None:
        return _measurers[0]
    _measurers[:] = [Measurer()]
    return _measurers[0]


def _environment() -> dict[str, str]:
    """Return the environment of this process without the memory settings of dask."""
    theirs = dask.config.get("distributed.nanny.pre-spawn-environ", {})
    found = dict(os.environ)
    for name, value in theirs.items():
        if found.get(name) == str(value):
            with suppress(KeyError):
                del found[name]
    return found
