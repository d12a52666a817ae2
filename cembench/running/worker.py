"""The process that measures a cell once: ``python -m cembench.running.worker JOB.json``.

The job names the mesh's arrays, which were checked, and the file to write. If that file is not
there in the end, the worker died.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Literal, NoReturn

import numpy as np
from pydantic import BaseModel

from cembench.core.errors import MeshError
from cembench.core.notices import Notice
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import load_algorithm
from cembench.results.records import Cell, Fault, Outcome, Round
from cembench.running.comparable import Used
from cembench.running.external.call import use_folder
from cembench.running.judge import Promise
from cembench.running.judging import Checked, JudgedCalls, judged_calls, judged_check
from cembench.running.measure import call_cell, timed_calls
from cembench.running.motion import moved
from cembench.running.process import die_with_parent, limit_memory
from cembench.running.processor import keep_orphans
from cembench.running.returned import outcome_of_error

#: What the geometry loads where it needs it, because it takes a tenth of a second.
_LOADED_LATE = ("igl", "scipy.optimize")
#: The folder beside the answer in which external programs have theirs.
PROGRAMS = "programs"
#: The kinds of surfaces, by the names that jobs have for them.
MESH_TYPES = {kind.__name__: kind for kind in (TriangleMesh, DiskMesh, HoledMesh)}


JobTask = Literal["check", "time", "again", "judge check", "judge calls"]


class Job(BaseModel):
    """What one process has to do."""

    #: "check": one call, its map and its memory. "time": warmed up, as often as is worth it.
    #: "again": one call on the surface in the first of the motions, its map alone.
    #: "judge check", "judge calls": of what one of these left; no algorithm is imported for that.
    task: JobTask
    cell: Cell
    plugins: tuple[str, ...]
    mesh_type: str
    notices: tuple[Notice, ...]
    #: Of V and F, as ``.npy``.
    mesh_files: tuple[Path, Path]
    #: Takes an :class:`Answer`.
    answer_file: Path
    #: Takes the map of a check, or those of timed calls, a row each.
    uv_file: Path
    #: What the maps of timed calls are compared with.
    checked: Checked = Checked()
    #: Of the surface in each call of a process that times, and whether the first is timed if long.
    motions: tuple[str, ...] = ()
    first_counts: bool = True
    #: What is judged: what a check told of its call, or what the rows of `uv_file` are called.
    promise: Promise = Promise()
    called: Outcome | None = None
    names: tuple[str, ...] = ()
    #: Samples of maps of other processes, ``.npy``, by motion; and whether such repeat themselves.
    known: dict[str, Path] = {}
    repeats: bool | None = None
    memory_bytes: int | None = None
    #: The number of the process that this one ends with.
    parent: int


class Answer(BaseModel):
    """What a process found: the outcome of a check or of what failed, or the timed calls."""

    outcome: Outcome | None = None
    round: Round | None = None
    #: Of timed calls: what to call the map of each, its motion, and what they used.
    names: tuple[str, ...] = ()
    motions: tuple[str, ...] = ()
    used: Used | None = None
    #: What was seen from outside: see :class:`~cembench.running.process.ProcessEnd`.
    running: tuple[int, ...] = ()
    judged: JudgedCalls | None = None


def main(path: Path) -> None:
    """Do the job that the file describes."""
    job = Job.model_validate_json(path.read_bytes())
    die_with_parent(job.parent)
    keep_orphans()
    load_libraries()
    if job.memory_bytes is not None:
        limit_memory(job.memory_bytes)
    use_folder(job.answer_file.with_name(PROGRAMS))
    answer = _TASKS[job.task](job)
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
    mesh = _mesh(job)
    outcome, uv = call_cell(load_algorithm(job.cell.algorithm, job.plugins), mesh, job.cell)
    if uv is not None:
        np.save(job.uv_file, uv)
    return Answer(outcome=outcome)


def _again(job: Job) -> Answer:
    given = moved(_mesh(job), job.motions[0])
    cell = job.cell.model_copy(update={"mesh_hash": given.hash})
    outcome, uv = call_cell(load_algorithm(cell.algorithm, job.plugins), given, cell)
    if uv is not None:
        np.save(job.uv_file, uv)
    return Answer(outcome=outcome)


def _time(job: Job) -> Answer:
    began, mesh = monotonic(), _mesh(job)
    algorithm = load_algorithm(job.cell.algorithm, job.plugins)
    found = timed_calls(algorithm, mesh, job.cell, job.motions, first_counts=job.first_counts)
    if isinstance(found, Outcome):
        return Answer(outcome=found)
    measured, told = found
    np.save(job.uv_file, np.stack([uv for uv in told.maps if not isinstance(uv, Fault)]))
    used = told.used()
    used.began = began
    if algorithm.program is not None:
        used.own = 0.0  # writing and reading the files is not in the program's wall clock
    return Answer(round=measured, names=tuple(told.names()), motions=tuple(told.motions), used=used)


def _judge_check(job: Job) -> Answer:
    assert job.called is not None
    return Answer(outcome=judged_check(job.promise, _mesh(job), job.called, np.load(job.uv_file)))


def _judge_calls(job: Job) -> Answer:
    mesh = _mesh(job)
    maps = np.load(job.uv_file, mmap_mode="r")
    rows = [np.array(row) for row in maps.reshape(len(job.names), -1)]
    named = list(zip(job.names, job.motions, rows, strict=True))
    known = {motion: np.load(file) for motion, file in job.known.items()}
    try:
        judged = judged_calls(job.promise, mesh, job.checked, named, known, repeats=job.repeats)
    except MemoryError as error:
        return Answer(outcome=outcome_of_error(error, mesh))
    return Answer(judged=judged)


_TASKS: dict[str, Callable[[Job], Answer]] = {
    "check": _check,
    "time": _time,
    "again": _again,
    "judge check": _judge_check,
    "judge calls": _judge_calls,
}


def _mesh(job: Job) -> TriangleMesh:
    V, F = (np.load(file) for file in job.mesh_files)
    V.setflags(write=False)
    F.setflags(write=False)
    mesh = MESH_TYPES[job.mesh_type].trusted(V, F, job.cell.mesh, job.notices)
    if mesh.hash != job.cell.mesh_hash:
        raise MeshError(f"{job.mesh_files[0]} or {job.mesh_files[1]} was changed; run again.")
    return mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    end()
