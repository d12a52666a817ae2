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
from cembench.core.errors import ClusterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_algorithm
from cembench.results.machines import differences
from cembench.results.records import Cell, Record
from cembench.results.store import Store
from cembench.running.cluster.host import Turn, kept_surface, unit_folder
from cembench.running.cluster.units import Unit
from cembench.running.environment import describe_environment, machine_name
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
    environment = _environment()
    told = differences(unit.software, environment) if unit.software else []
    if told:
        tell({"what": "refused", "why": "; ".join(told)})
        return None
    mesh = surface_of(unit)
    tasks = [task_of(unit, cell, mesh) for cell in unit.cells]
    tell({"what": "began", "environment": json.dumps(environment)})
    with Turn() as turn:
        turn.share()
        return run_tasks(tasks, Store(folder), _options(unit), Teller(tell, turn))


@cache
def _environment() -> dict[str, Any]:
    """Return the environment, determined once per process."""
    return describe_environment()


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


def task_of(unit: Unit, cell: Cell, mesh: TriangleMesh) -> Task:
    """Return a cell's task on this machine, whose algorithm is the client's."""
    algorithm = load_algorithm(cell.algorithm, unit.plugins)
    sources = sources_of(algorithm)
    if hash_of(sources) != cell.code_hash:
        raise ClusterError(
            f"{cell.algorithm} is other code on {machine_name()} than here: "
            f"{', '.join(sources)} differ. Install the same version of cembench and of plug-ins "
            "on all machines."
        )
    return Task(cell, algorithm, mesh, unit.facts, unit.plugins, sources)


def _options(unit: Unit) -> Options:
    """Return the options of a run, with this machine's memory and cores as their bounds."""
    options = unit.run_options()
    free = int(0.9 * psutil.virtual_memory().available)
    jobs = min(options.jobs, psutil.cpu_count() or 1)
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
            known = isinstance(error, ClusterError)
            tell({"what": "failed", "why": str(error) if known else traceback.format_exc()})


def _listen(asked: Any, keys: SimpleQueue[str]) -> None:
    for line in asked:
        keys.put(line.strip())
    os._exit(1)  # the worker is gone; what this process started ends with it


if __name__ == "__main__":
    main()
