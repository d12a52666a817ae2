"""Units of work: one surface under one policy, with all its algorithms and rounds.

A unit is measured by one machine, so the seconds of every ratio are from one machine and sitting.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import COMMAND
from cembench.results.records import Cell, MeshFacts
from cembench.running.options import Options
from cembench.running.plan import Task


@dataclass(frozen=True, eq=False)
class Unit:
    """What a worker gets."""

    #: The token of the run's folder: two runs never resume each other's unfinished units.
    token: str
    cells: tuple[Cell, ...]
    mesh: TriangleMesh
    facts: MeshFacts
    #: By the plug-ins' names, their files by relative path; none of a module or a command.
    plugins: Mapping[str, Mapping[str, bytes]]
    options: Options

    @property
    def key(self) -> str:
        """Hash of the measured content and the run; settings such as the budget are excluded.

        So a worker resumes an unfinished unit if the run continues with another budget, or with
        more machines to share it.
        """
        cells = (cell.model_dump_json() for cell in self.cells)
        content = " ".join([self.token, type(self.mesh).__name__, *cells])
        return hashlib.sha256(content.encode()).hexdigest()[:24]


def pack(tasks: Sequence[Task], token: str, options: Options) -> Unit:
    """Return the unit of these tasks."""
    mesh = tasks[0].mesh
    return Unit(
        token,
        tuple(task.cell for task in tasks),
        mesh.renamed(mesh.name),  # without what was computed of it
        tasks[0].facts,
        _plugins(tasks),
        # The worker's folder is empty unless the unit is resumed.
        replace(options, fresh=False, rerun_failed=False),
    )


def _plugins(tasks: Sequence[Task]) -> dict[str, dict[str, bytes]]:
    """Return the plug-ins that these tasks need, with their files."""
    found: dict[str, dict[str, bytes]] = {}
    for plugin in dict.fromkeys(name for task in tasks for name in task.plugins):
        path = Path(plugin)
        if plugin.startswith(COMMAND) or not path.is_file():
            found[plugin] = {}
        elif inside := {name for task in tasks if _declares(path, task) for name in task.sources}:
            found[plugin] = {n: (path.parent / n).read_bytes() for n in {path.name, *inside}}
    return found


def _declares(plugin: Path, task: Task) -> bool:
    file = task.algorithm.file
    return file is not None and file.resolve() == plugin.resolve()
