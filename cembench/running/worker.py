"""The process that measures a cell once: ``python -m cembench.running.worker JOB.json``.

The job names the mesh's arrays, which were checked, and the file to write. If that file is not
there in the end, the worker died.
"""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np
from pydantic import BaseModel

from cembench.core.errors import MeshError
from cembench.core.notices import Notice
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Algorithm, load_algorithm
from cembench.results.records import Cell, Outcome, Round
from cembench.running.external.call import use_folder
from cembench.running.measure import Checked, check_cell, time_cell
from cembench.running.process import die_with_parent, limit_memory
from cembench.running.processor import keep_orphans

#: What the geometry loads where it needs it, because it takes a tenth of a second.
_LOADED_LATE = ("igl", "scipy.optimize")
#: The folder beside the answer in which external programs have theirs.
PROGRAMS = "programs"
_MESH_TYPES = {kind.__name__: kind for kind in (TriangleMesh, DiskMesh, HoledMesh)}


class Job(BaseModel):
    """What one process has to do."""

    #: "check": one call, its map and its memory. "time": warmed up, as often as is worth it.
    task: Literal["check", "time"]
    cell: Cell
    plugins: tuple[str, ...]
    mesh_type: str
    notices: tuple[Notice, ...]
    #: Of V and F, as ``.npy``.
    mesh_files: tuple[Path, Path]
    #: Takes an :class:`Answer`.
    answer_file: Path
    #: Takes the map of a check.
    uv_file: Path
    #: What the maps of timed calls are compared with.
    checked: Checked = Checked()
    memory_bytes: int | None = None
    #: The number of the process that this one ends with.
    parent: int


class Answer(BaseModel):
    """What a process found: the outcome of a check or of what failed, or the timed calls."""

    outcome: Outcome | None = None
    round: Round | None = None


def main(path: Path) -> None:
    """Do the job that the file describes."""
    job = Job.model_validate_json(path.read_bytes())
    die_with_parent(job.parent)
    keep_orphans()
    load_libraries()
    if job.memory_bytes is not None:
        limit_memory(job.memory_bytes)
    use_folder(job.answer_file.with_name(PROGRAMS))
    answer = _time(job) if job.task == "time" else _check(job)
    job.answer_file.write_text(answer.model_dump_json())


def end() -> NoReturn:
    """End at once: taking an interpreter down with all its libraries takes longer than a call."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):  # the algorithm may have closed or replaced it
            stream.flush()
    os._exit(0)


def load_libraries() -> None:
    """Load now what the first call would otherwise load in the middle of being measured."""
    for name in _LOADED_LATE:
        importlib.import_module(name)


def _check(job: Job) -> Answer:
    outcome, uv = check_cell(*_loaded(job), job.cell)
    if uv is not None:
        np.save(job.uv_file, uv)
    return Answer(outcome=outcome)


def _time(job: Job) -> Answer:
    found = time_cell(*_loaded(job), job.cell, job.checked)
    return Answer(outcome=found) if isinstance(found, Outcome) else Answer(round=found)


def _loaded(job: Job) -> tuple[Algorithm, TriangleMesh]:
    algorithm = load_algorithm(job.cell.algorithm, job.plugins)
    V, F = (np.load(file) for file in job.mesh_files)
    V.setflags(write=False)
    F.setflags(write=False)
    mesh = _MESH_TYPES[job.mesh_type].trusted(V, F, job.cell.mesh, job.notices)
    if mesh.hash != job.cell.mesh_hash:
        raise MeshError(f"{job.mesh_files[0]} or {job.mesh_files[1]} was changed; run again.")
    return algorithm, mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    end()
