"""Units of work for a machine: one surface under one policy, with its algorithms and rounds.

So every ratio is formed of seconds from one machine and one sitting.
"""

from __future__ import annotations

import hashlib
import heapq
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, TypeAdapter

from cembench.core.notices import Notice
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import COMMAND
from cembench.results.comparison import circumstances
from cembench.results.records import Cell, MeshFacts
from cembench.running.options import Options
from cembench.running.plan import Task

#: Files of plug-ins: by the plug-in as it was named, their content by relative path.
PluginFiles = dict[str, dict[str, bytes]]


class Unit(BaseModel):
    """All cells of one surface under one policy, as data that a worker can read."""

    model_config = ConfigDict(frozen=True)

    #: Of the run's folder: two runs never share what a worker keeps of an unfinished unit.
    token: str
    cells: tuple[Cell, ...]
    mesh_type: str
    notices: tuple[Notice, ...]
    facts: MeshFacts
    #: How many triangles a registered surface was asked for; None: its usual number.
    faces: int | None = None
    plugins: tuple[str, ...] = ()
    options: dict[str, Any] = {}
    #: What a machine has to have in common with the client; empty: nothing.
    software: dict[str, Any] = {}

    @property
    def key(self) -> str:
        """Hash of what is measured and for which run, not of how its cells are gone about.

        So what a worker keeps of an unfinished unit counts when the run goes on with another
        budget, or with more machines to share it.
        """
        what = self.model_dump_json(include={"token", "cells", "mesh_type"})
        return hashlib.sha256(what.encode()).hexdigest()[:24]

    @property
    def mesh(self) -> str:
        """The surface's name."""
        return self.cells[0].mesh

    @property
    def mesh_hash(self) -> str:
        """The surface's hash."""
        return self.cells[0].mesh_hash

    def run_options(self) -> Options:
        """The options of the run."""
        return TypeAdapter(Options).validate_python(self.options)


@dataclass(frozen=True)
class Parcel:
    """A unit with its tasks and its expected seconds."""

    unit: Unit
    tasks: tuple[Task, ...]
    plugin_files: PluginFiles
    seconds: float = 0.0

    @property
    def surface(self) -> TriangleMesh:
        """The surface itself."""
        return self.tasks[0].mesh

    @cached_property
    def by_label(self) -> dict[str, Task]:
        """The tasks by the labels of their cells."""
        return {task.cell.label: task for task in self.tasks}


def grouped(tasks: Sequence[Task]) -> list[list[Task]]:
    """Return the tasks of each unit: same surface, policy, back end and threads, in order."""
    found: dict[tuple[str, str], list[Task]] = {}
    for task in tasks:
        found.setdefault((circumstances(task.cell), task.cell.mesh), []).append(task)
    return list(found.values())


def parcel(
    tasks: Sequence[Task],
    token: str,
    options: Options,
    faces: int | None = None,
    software: dict[str, Any] | None = None,
    seconds: float = 0.0,
) -> Parcel:
    """Pack the tasks of one unit."""
    plugins, files = _plugins(tasks)
    first = tasks[0]
    unit = Unit(
        token=token,
        cells=tuple(task.cell for task in tasks),
        mesh_type=type(first.mesh).__name__,
        notices=first.mesh.notices,
        facts=first.facts,
        faces=faces,
        plugins=plugins,
        # The worker's folder holds nothing of before, unless it is to be gone on from.
        options=asdict(replace(options, fresh=False, rerun_failed=False)),
        software=software or {},
    )
    return Parcel(unit, tuple(tasks), files, seconds)


def _plugins(tasks: Sequence[Task]) -> tuple[tuple[str, ...], PluginFiles]:
    """Return the plug-ins that these tasks need, and the files of those.

    A module, or a program's command line, has to be on the workers: only its name travels.
    """
    named: list[str] = []
    files: PluginFiles = {}
    for plugin in dict.fromkeys(name for task in tasks for name in task.plugins):
        path = Path(plugin)
        if plugin.startswith(COMMAND) or not path.is_file():
            named.append(plugin)
        else:
            inside = {name for task in tasks if _declares(path, task) for name in task.sources}
            if inside:
                named.append(plugin)
                places = {name: path.parent / name for name in sorted({path.name, *inside})}
                files[plugin] = {n: place.read_bytes() for n, place in places.items()}
    return tuple(named), files


def _declares(plugin: Path, task: Task) -> bool:
    file = task.algorithm.file
    return file is not None and file.resolve() == plugin.resolve()


def makespan(seconds: Sequence[float], machines: int) -> float:
    """Return the seconds that `machines` machines take for all units, the longest first.

    >>> makespan([3.0, 2.0, 2.0], 2)
    4.0
    """
    free = [0.0] * machines
    for one in sorted(seconds, reverse=True):
        heapq.heappush(free, heapq.heappop(free) + one)
    return max(free)


def most_useful(seconds: Sequence[float]) -> int:
    """Return how many machines are of use at most: with them, the longest unit takes as long.

    One per cent is no matter.

    >>> most_useful([3.0, 2.0, 1.0])
    2
    """
    enough, longest = len(seconds), max(seconds, default=0.0)
    fewest = 1
    while fewest < enough:
        tried = (fewest + enough) // 2
        if makespan(seconds, tried) > 1.01 * longest:
            fewest = tried + 1
        else:
            enough = tried
    return enough
