"""The process of a worker that measures units: ``python -m cembench.running.cluster.measure``.

It reads a line with the folder of a unit from standard input, and writes what happens as lines of
JSON to standard output. It is apart from the worker's own process, whose threads and clock are
dask's; and it ends, with all that it started, when the worker does.
"""

from __future__ import annotations

import json
import os
import threading
import traceback
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import psutil

from cembench.core.atomic import read_model
from cembench.core.errors import CembenchError, ClusterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, load_algorithm
from cembench.results.machines import differences
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.cluster.host import Turn, kept_surface, unit_folder
from cembench.running.cluster.units import Unit
from cembench.running.environment import describe_environment, machine_name, usable_cores
from cembench.running.local import Options, Step, Watcher, run_tasks
from cembench.running.plan import Task
from cembench.running.sources import hash_of, sources_of
from cembench.running.worker import MESH_TYPES

Tell = Callable[[Mapping[str, Any]], None]
#: The files of a unit's folder.
UNIT, RUN = "unit.json", "run"


class Teller(Watcher):
    """Reports the progress of a unit to the client, and waits for the machine before timing."""

    def __init__(self, tell: Tell, turn: Turn) -> None:
        self.tell = tell
        self.turn = turn

    def timing_starts(self) -> None:
        """Wait until no other worker of the machine is busy."""
        self.turn.alone(lambda: self.tell({"what": "queues"}))

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """Tell."""
        self.tell({"what": "adds_rounds", "cell": task.cell.label, "rounds": rounds})

    def starts(self, task: Task, step: Step) -> None:
        """Tell."""
        self.tell({"what": "starts", "cell": task.cell.label, "step": vars(step)})

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """Tell."""
        about = {"cell": task.cell.label, "step": vars(step), "seconds": seconds}
        self.tell({"what": "ends", **about})


def measure(unit: Unit, folder: Path, tell: Tell) -> list[Record] | None:
    """Measure a unit in its own folder, and resume it if the folder has a part of it.

    None where the machine has other software and must not measure, which is told.

    Raises
    ------
    ClusterError
        The machine has other code than the client, or not the surface.

    """
    environment = describe_environment()
    told = differences(unit.software, environment) if unit.software else []
    if told:
        tell({"what": "refused", "why": "; ".join(told)})
        return None
    mesh = surface_of(unit)
    tasks = tasks_of(unit, mesh)
    tell({"what": "began", "environment": json.dumps(environment)})
    with Turn() as turn:
        turn.share()
        teller = Teller(tell, turn)
        return run_tasks(tasks, Store(folder), _options(unit), teller, environment=environment)


def surface_of(unit: Unit) -> TriangleMesh:
    """Return the surface of a unit, which was sent to this machine."""
    arrays = kept_surface(unit.mesh_hash)
    kind = MESH_TYPES[unit.mesh_type]
    mesh = arrays and kind.trusted(*arrays, unit.mesh, unit.notices)
    if mesh is None or mesh.hash != unit.mesh_hash:
        raise ClusterError(f"the surface {unit.mesh} is not on this machine any more; run again.")
    mesh.V.setflags(write=False)
    mesh.F.setflags(write=False)
    return mesh


def tasks_of(unit: Unit, mesh: TriangleMesh) -> list[Task]:
    """Return a unit's tasks on this machine, whose algorithms are the client's.

    The files of a plug-in are read once a unit, however many algorithms it declares.
    """
    read: dict[tuple[Path | None, str], Mapping[str, str]] = {}
    tasks = []
    for cell in unit.cells:
        algorithm = _algorithm(cell.algorithm, unit.plugins)
        declared = (algorithm.file, algorithm.module)
        if algorithm.program is not None:  # whose files are its own
            sources: Mapping[str, str] = sources_of(algorithm)
        elif declared in read:
            sources = read[declared]
        else:
            sources = read[declared] = sources_of(algorithm)
        if hash_of(sources) != cell.code_hash:
            raise ClusterError(
                f"{cell.algorithm} is other code on {machine_name()} than here: "
                f"{', '.join(sources)} differ. Install the same version of cembench and of "
                "plug-ins on all machines."
            )
        tasks.append(Task(cell, algorithm, mesh, unit.facts, unit.plugins, sources))
    return tasks


@cache
def _algorithm(name: str, plugins: tuple[str, ...]) -> Algorithm:
    """Return an algorithm, which a process looks up once: plug-ins lie in folders by content."""
    return load_algorithm(name, plugins)


def _options(unit: Unit) -> Options:
    """Return the options of a run, with this machine's memory and cores as their bounds."""
    options = unit.run_options()
    free = int(0.9 * psutil.virtual_memory().available)
    jobs = min(options.jobs, usable_cores())
    return replace(options, memory_bytes=options.memory_bytes or free, jobs=jobs)


def main() -> None:
    """Measure requested units until standard input ends."""
    # What an algorithm prints, or reads, is not what passes between the worker and this process.
    asked = os.fdopen(os.dup(0))
    told = os.fdopen(os.dup(1), "w", buffering=1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    keys: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_listen, args=(asked, keys), daemon=True).start()

    def tell(event: Mapping[str, Any]) -> None:
        told.write(json.dumps(event) + "\n")

    while True:
        folder = unit_folder(keys.get())
        try:
            if measure(read_model(folder / UNIT, Unit), folder / RUN, tell) is not None:
                tell({"what": "done"})
        except Exception as error:
            known = isinstance(error, CembenchError)
            tell({"what": "failed", "why": str(error) if known else traceback.format_exc()})


def _listen(asked: Any, keys: SimpleQueue[str]) -> None:
    for line in asked:
        keys.put(line.strip())
    os._exit(1)  # the worker is gone; what this process started ends with it


if __name__ == "__main__":
    main()
