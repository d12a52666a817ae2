"""The process that measures a cell once: ``python -m cembench.running.worker JOB.json``.

The job names the mesh's checked arrays and the file to write. If that file is missing at the end,
the worker died.
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
from cembench.registry import Algorithm, load_algorithm
from cembench.results.records import Cell, Fault, Outcome, Round
from cembench.running.external.call import use_folder
from cembench.running.map_checks import Checked, JudgedCalls, judged_calls, judged_check
from cembench.running.map_promises import Promise
from cembench.running.measure import Timed, call_cell, preparing_seconds, timed_together
from cembench.running.process import die_with_parent, limit_memory
from cembench.running.processor import after_call, keep_orphans
from cembench.running.relay import RELAYS, end_solvers, start_solver
from cembench.running.rigid_motion import moved
from cembench.running.sanitized_result import outcome_of_error
from cembench.running.timing_checks import Used

#: Modules loaded on demand elsewhere, because each takes a tenth of a second.
_LOADED_LATE = ("igl", "scipy.linalg", "scipy.optimize", "scipy.sparse.linalg")
#: The folder next to the answer for the folders of external programs.
PROGRAMS = "programs"
#: The kinds of surfaces, by the names that jobs have for them.
MESH_TYPES = {kind.__name__: kind for kind in (TriangleMesh, DiskMesh, HoledMesh)}


JobTask = Literal["check", "time", "again", "judge check", "judge calls"]


class Part(BaseModel):
    """A cell that is timed in a process, alone or with others."""

    cell: Cell
    plugins: tuple[str, ...]
    #: The motions of the surface for the calls, most of them drawn when a call begins, and whether
    #: a long first call is timed.
    motions: tuple[str, ...]
    first_counts: bool
    #: Number of calls before the timed ones.
    untimed: int
    #: Output file for the maps of the calls, one row each.
    uv_file: Path


class Job(BaseModel):
    """The job of one process."""

    #: "check": one call, with its map and memory. "time": warm-ups and timed calls of the `parts`.
    #: "again": one call on the surface in the first motion, for its map. "judge check",
    #: "judge calls": judge the results of these without importing an algorithm.
    task: JobTask
    cell: Cell
    plugins: tuple[str, ...]
    mesh_type: str
    notices: tuple[Notice, ...]
    #: Files of V and F, ``.npy``.
    mesh_files: tuple[Path, Path]
    #: Output file for the :class:`Answer`.
    answer_file: Path
    #: Output file for the map of a check; input for a judge, of timed calls with one row each.
    uv_file: Path
    parts: tuple[Part, ...] = ()
    #: The checked map's data, for comparison with timed calls.
    checked: Checked = Checked()
    #: Motions of the surface for the calls.
    motions: tuple[str, ...] = ()
    #: Input of judging: the outcome of a check, or the names of the rows of `uv_file`.
    promise: Promise = Promise()
    called: Outcome | None = None
    names: tuple[str, ...] = ()
    #: Samples of maps from other processes (``.npy``) by motion.
    known: dict[str, Path] = {}
    memory_bytes: int | None = None
    #: Id of the parent process; this process ends with it.
    parent: int


class TimedPart(BaseModel):
    """The timed calls of a cell: their figures, and the names and motions of their maps."""

    round: Round
    names: tuple[str, ...]
    motions: tuple[str, ...]


class Answer(BaseModel):
    """The answer of a process: an outcome, or the timed calls of its cells, and what they used."""

    outcome: Outcome | None = None
    parts: tuple[TimedPart, ...] = ()
    used: Used | None = None
    #: Observed by the parent; see :class:`~cembench.running.process.ProcessEnd`.
    running: tuple[int, ...] = ()
    cpu_seconds: float = 0.0
    judged: JudgedCalls | None = None


def main(path: Path) -> None:
    """Run the job described by the file."""
    job = Job.model_validate_json(path.read_bytes())
    die_with_parent(job.parent)
    keep_orphans()
    load_libraries()
    if job.memory_bytes is not None:
        limit_memory(job.memory_bytes)
    use_folder(job.answer_file.with_name(PROGRAMS))
    answer = _TASKS[job.task](job)
    end_solvers()
    job.answer_file.write_text(answer.model_dump_json(), encoding="utf-8")


def end() -> NoReturn:
    """End at once, because an orderly shutdown of the interpreter takes longer than a call."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):  # the algorithm may have closed or replaced it
            stream.flush()
    os._exit(0)


def load_libraries() -> None:
    """Load modules that the first call would otherwise load while it is measured."""
    for name in _LOADED_LATE:
        importlib.import_module(name)


def _loaded(cell: Cell, plugins: tuple[str, ...]) -> Algorithm:
    algorithm = load_algorithm(cell.algorithm, plugins)
    start_solver(cell.algorithm)
    return algorithm


def _check(job: Job) -> Answer:
    algorithm = _loaded(job.cell, job.plugins)
    surface = moved(_mesh(job), *job.motions) if job.motions else _mesh(job)
    cell = job.cell.model_copy(update={"mesh_hash": surface.hash})
    outcome, uv = call_cell(algorithm, surface, cell)
    if uv is not None:
        np.save(job.uv_file, uv)
    return Answer(outcome=outcome)


def _time(job: Job) -> Answer:
    began, preparing = monotonic(), preparing_seconds(_as_large(job))
    cells = [
        Timed(_loaded(p.cell, p.plugins), p.cell, p.motions, p.first_counts, p.untimed)
        for p in job.parts
    ]
    # Read only now: an algorithm that is imported could prepare for its surface.
    result = timed_together(_mesh(job), cells)
    if isinstance(result, Outcome):
        return Answer(outcome=result)
    each, everything = result
    used = everything.used(preparing)
    used.began = began
    if any(one.algorithm.program is not None for one in cells):
        used.own = 0.0  # writing and reading the files is not part of the program's wall-clock time
    if any(part.cell.algorithm in RELAYS for part in job.parts):
        used.disturbed = 0  # a process that has answered may still be about to sleep
    parts = []
    for part, (measured, timed) in zip(job.parts, each, strict=True):
        maps = [call.uv for call in timed.calls if not isinstance(call.uv, Fault)]
        np.save(part.uv_file, np.stack(maps))
        motions = tuple(call.motion for call in timed.calls)
        parts.append(TimedPart(round=measured, names=tuple(timed.names()), motions=motions))
    end_solvers()
    used.everything = after_call().total
    return Answer(parts=tuple(parts), used=used)


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
        judged = judged_calls(job.promise, mesh, job.checked, named, known)
    except MemoryError as error:
        return Answer(outcome=outcome_of_error(error, mesh))
    return Answer(judged=judged)


_TASKS: dict[str, Callable[[Job], Answer]] = {
    "check": _check,
    "time": _time,
    "again": _check,
    "judge check": _judge_check,
    "judge calls": _judge_calls,
}


def _as_large(job: Job) -> TriangleMesh:
    """Return a mesh of as many vertices and triangles as the job's, all of them 0."""
    V, F = (np.load(file, mmap_mode="r") for file in job.mesh_files)
    return TriangleMesh.trusted(np.zeros(V.shape), np.zeros(F.shape, dtype=np.int64))


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
