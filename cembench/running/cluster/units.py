"""Units of work: one surface under one policy, with all its algorithms and rounds.

A unit is measured by one machine, so the seconds of every ratio are from one machine and sitting.
"""

from __future__ import annotations

import hashlib
import heapq
from bisect import bisect_left
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

#: The files of plug-ins, by the name of the plug-in: their content by relative path.
PluginFiles = dict[str, dict[str, bytes]]


class Unit(BaseModel):
    """All cells of one surface under one policy, as data that a worker can read."""

    model_config = ConfigDict(frozen=True)

    #: The token of the run's folder: two runs never resume each other's unfinished units.
    token: str
    cells: tuple[Cell, ...]
    mesh_type: str
    notices: tuple[Notice, ...]
    facts: MeshFacts
    plugins: tuple[str, ...] = ()
    options: dict[str, Any] = {}

    @property
    def key(self) -> str:
        """Hash of the measured content and the run; settings such as the budget are excluded.

        So a worker resumes an unfinished unit if the run continues with another budget, or with
        more machines to share it.
        """
        content = self.model_dump_json(include={"token", "cells", "mesh_type"})
        return hashlib.sha256(content.encode()).hexdigest()[:24]

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
    groups: dict[tuple[str, str], list[Task]] = {}
    for task in tasks:
        groups.setdefault((circumstances(task.cell), task.cell.mesh), []).append(task)
    return list(groups.values())


def parcel(tasks: Sequence[Task], token: str, options: Options, seconds: float = 0.0) -> Parcel:
    """Pack the tasks of one unit."""
    plugins, files = _plugins(tasks)
    first = tasks[0]
    unit = Unit(
        token=token,
        cells=tuple(task.cell for task in tasks),
        mesh_type=type(first.mesh).__name__,
        notices=first.mesh.notices,
        facts=first.facts,
        plugins=plugins,
        # The worker's folder is empty unless the unit is resumed.
        options=asdict(replace(options, fresh=False, rerun_failed=False)),
    )
    return Parcel(unit, tuple(tasks), files, seconds)


def _plugins(tasks: Sequence[Task]) -> tuple[tuple[str, ...], PluginFiles]:
    """Return the names of the plug-ins that these tasks need, and the files of those.

    A module, or the program of a command line, has to be on the workers: only its name is sent.
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
    """Return the seconds that `machines` machines take for all units, longest first.

    >>> makespan([3.0, 2.0, 2.0], 2)
    4.0
    """
    free = [0.0] * machines
    for one in sorted(seconds, reverse=True):
        heapq.heappush(free, heapq.heappop(free) + one)
    return max(free)


def most_useful(seconds: Sequence[float]) -> int:
    """Return the number of machines beyond which the run takes as long as its longest unit.

    Differences below 1 % are ignored.

    >>> most_useful([3.0, 2.0, 1.0])
    2
    """
    longest = max(seconds, default=0.0)
    numbers = range(1, len(seconds))
    enough = bisect_left(numbers, True, key=lambda n: makespan(seconds, n) <= 1.01 * longest)
    return min(len(seconds), 1 + enough)
