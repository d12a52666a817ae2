"""Start one process for one job, and read its answer.

Where the system allows it, the process is forked from a server that has loaded the libraries
(:mod:`cembench.running.fork_server`). Judges are forked from a server of their own, which never saw
an algorithm. Nothing that a process leaves is trusted: not its answer, its map, or the folder.
"""

from __future__ import annotations

import atexit
import io
import os
import shutil
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from cembench.core.arrays import Complex
from cembench.core.notices import Notice, NoticeKind
from cembench.linear_algebra.backends import default_backend
from cembench.results.records import Fault, FaultKind, Outcome, Status, not_ok
from cembench.running.environment import for_measuring
from cembench.running.fork_server import ForkServer, ServerGoneError, can_fork
from cembench.running.map_promises import Promise
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.process import Limits, ProcessEnd, finds_all, run_limited, spawning
from cembench.running.worker import PROGRAMS, Answer, Job, JobTask

#: Wall-clock seconds that judging a map may take at least.
JUDGE_SECONDS = 600.0
#: The largest answer that is read: what a worker returns takes a few megabytes at most.
LARGEST_ANSWER_BYTES = 2**24


@dataclass(eq=False)
class Launcher:
    """Starts processes, one at a time.

    They are forked where `forks` allows it and the system can; the server ends with :meth:`close`,
    and the next process gets a new one.
    """

    #: The folder for exchanging files with processes.
    scratch: Path
    options: Options
    forks: bool = True
    #: That of the server for judges: launchers that run in parallel have different ones.
    number: int = 0
    #: Shared by launchers that are stopped together.
    stopped: threading.Event = field(default_factory=threading.Event)
    _server: ForkServer | None = None
    #: Status of the mesh files when they were written.
    _written: dict[Path, tuple[int, ...]] = field(default_factory=dict)

    def close(self) -> None:
        """End the server, if there is one."""
        if self._server is not None:
            self._server.close()
            self._server = None

    @property
    def uv_file(self) -> Path:
        """The file of the map that the last process left, if any."""
        return self.scratch / "uv.npy"

    def run(self, task: Task, what: JobTask, seconds: float, **more: Any) -> Answer:
        """Run a process within these seconds; return its answer, or an outcome if it left none."""
        self._make_scratch()
        answer_file, log = self.scratch / "answer.json", self.scratch / "log.txt"
        judges = what.startswith("judge")
        programs = self.scratch / PROGRAMS
        for stale in (answer_file, log, programs, *([] if judges else [self.uv_file])):
            remove(stale)
        job = Job(
            task=what,
            cell=task.cell,
            plugins=() if judges else task.plugins,
            mesh_type=type(task.mesh).__name__,
            notices=task.mesh.notices,
            mesh_files=self._mesh_files(task),
            answer_file=answer_file,
            uv_file=self.uv_file,
            promise=Promise.of(task.algorithm),
            memory_bytes=self.options.memory_bytes,
            parent=os.getpid(),
            **more,
        )
        limits = Limits(seconds, self.options.memory_bytes)
        server = judges_server(self.number) if judges else self._own_server(job)
        ending = server and self._forked(server, job, limits, log, alone=judges)
        ending = ending or self._started(job, limits, log)
        with suppress(OSError):  # the folder may be gone
            remove(programs)  # of a program that was ended
        if ending.limit is None and ending.code == 0 and answer_file.exists():
            answer = _with_note(_read_answer(answer_file), ending.left)
            observed = {"running": ending.running, "cpu_seconds": ending.cpu_seconds}
            return answer.model_copy(update=observed)
        with suppress(OSError):  # it, or the folder, may be gone
            self.uv_file.unlink()
        outcome = _outcome_of(ending, seconds, self.options.memory_bytes)
        if not self.scratch.is_dir():
            detail = f"the folder for its answer no longer exists: {self.scratch}"
            fault = Fault(kind=FaultKind.PROCESS_ENDED, detail=detail)
            about = {"cause": f"{outcome.cause}; {detail}", "faults": (*outcome.faults, fault)}
            outcome = outcome.model_copy(update=about)
        return Answer(outcome=outcome)

    def judge(self, task: Task, what: JobTask, **more: Any) -> Answer:
        """Return the judgement of a map, by a process that never imported its algorithm."""
        return self.run(task, what, max(self.options.timeout, JUDGE_SECONDS), **more)

    def read_uv(self, task: Task) -> Complex | None:
        """Return the map that the last process left, if any; raise ValueError if it is no map."""
        if not self.uv_file.exists():
            return None
        uv = np.lib.format.open_memmap(self.uv_file, mode="r")
        entries = 3 * task.mesh.m if task.algorithm.target == "atlas" else task.mesh.n
        if uv.shape != (entries,) or uv.dtype != np.complex128:
            raise ValueError(f"uv is {uv.dtype} {uv.shape}; required is complex128 ({entries},)")
        return np.array(uv)

    def _make_scratch(self) -> None:
        """Recreate the scratch folder, whatever an algorithm did to it."""
        self.scratch = self.scratch.absolute()  # a process may run in a different folder
        if not self.scratch.is_dir():
            self.scratch.unlink(missing_ok=True)
            self.scratch.mkdir(parents=True)
        self.scratch.chmod(0o700)

    def _started(self, job: Job, limits: Limits, log: Path) -> ProcessEnd:
        command = [sys.executable, "-P", "-m", "cembench.running.worker", str(self._write(job))]
        start = spawning(command, for_measuring(job.cell.threads))
        return run_limited(start, limits, log, stopped=self.stopped.is_set)

    def _own_server(self, job: Job) -> ForkServer | None:
        """Return the server of processes with this job's back end; None if none can be forked."""
        if not self.forks or not can_fork(job.cell.threads):
            return None
        if self._server is None or self._server.backend != job.cell.backend:
            self.close()
            try:
                self._server = ForkServer(for_measuring(job.cell.threads), job.cell.backend)
            except ServerGoneError:
                self.forks = False
        return self._server

    def _forked(
        self, server: ForkServer, job: Job, limits: Limits, log: Path, *, alone: bool
    ) -> ProcessEnd | None:
        """Run a process forked from this server; return its end, None if the server is gone."""
        path = self._write(job.model_copy(update={"parent": server.pid}))
        try:
            start = server.forking(path)
            end = run_limited(start, limits, log, alone=alone, stopped=self.stopped.is_set)
            return replace(end, cpu_seconds=server.cpu_seconds())
        except ServerGoneError:
            if server is self._server:
                self.close()
            else:
                judges_server.cache_clear()
                server.close()
        return None

    def _write(self, job: Job) -> Path:
        path = self.scratch / "job.json"
        _put(path, job.model_dump_json().encode())
        return path

    def _mesh_files(self, task: Task) -> tuple[Path, Path]:
        """Return the files of V and F, written once per surface unless a cell changed them."""
        stem = task.cell.mesh_hash[:32]
        files = self.scratch / f"{stem}-V.npy", self.scratch / f"{stem}-F.npy"
        for file, array in zip(files, (task.mesh.V, task.mesh.F), strict=True):
            if not file.exists() or _stamp(file) != self._written.get(file):
                save_array(file, array)
                self._written[file] = _stamp(file)
        return files


@cache
def judges_server(number: int) -> ForkServer | None:
    """Return the server that forks the judges of this number; it ends with the calling thread."""
    if not can_fork(1):
        return None
    try:
        server = ForkServer(for_measuring(1), default_backend())
    except ServerGoneError:
        return None
    atexit.register(server.close)
    return server


def remove(path: Path) -> None:
    """Remove whatever is at the path of one of our own files in the scratch folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def save_array(path: Path, array: NDArray[Any]) -> None:
    """Write an ``.npy`` file to the scratch folder; numpy's own error does not say why it failed.

    Raises
    ------
    OSError
        It cannot be written; the error has the file's name, and the reason.
    """
    head, array = io.BytesIO(), np.ascontiguousarray(array)
    np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
    _put(path, head.getvalue(), array.data)


def _put(path: Path, *parts: bytes | memoryview) -> None:
    remove(path)
    try:
        with path.open("wb") as file:
            for part in parts:
                file.write(part)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def unreadable(why: str) -> Outcome:
    """Return the outcome of a process whose answer cannot be used."""
    detail = f"the process left an answer that cannot be read: {why}"
    return not_ok("failed", Fault(kind=FaultKind.UNREADABLE_ANSWER, detail=detail))


def mebibytes(size: float) -> str:
    """Return a number of bytes as text."""
    return f"{size / 2**20:,.0f} MiB"


def _stamp(file: Path) -> tuple[int, ...]:
    about = file.stat()
    return about.st_ino, about.st_size, about.st_mtime_ns


def _read_answer(file: Path) -> Answer:
    """Return a process's answer, or a fault: an algorithm may have written to the file."""
    try:
        size = file.stat().st_size
        if size > LARGEST_ANSWER_BYTES:
            raise ValueError(f"it takes {size:,} bytes; allowed are {LARGEST_ANSWER_BYTES:,}")
        return Answer.model_validate_json(file.read_bytes())
    except ValidationError as error:
        return Answer(outcome=unreadable(error.errors()[0]["msg"]))
    except (OSError, ValueError) as error:
        return Answer(outcome=unreadable(str(error)))


def _with_note(answer: Answer, left: int) -> Answer:
    """Add the notice that a checked call left processes behind."""
    if answer.outcome is None or not left:
        return answer
    hidden = "" if finds_all() else "; others, with another environment, may live on"
    text = f"left {left} processes behind, which were ended{hidden}"
    notes = (*answer.outcome.notes, Notice(NoticeKind.PROCESSES_LEFT, text))
    return Answer(outcome=answer.outcome.model_copy(update={"notes": notes}))


def _outcome_of(ending: ProcessEnd, seconds: float, memory_bytes: int | None) -> Outcome:
    """Return the outcome of a process that left no answer."""
    status: Status
    if ending.limit == "time":
        status, kind = "timeout", FaultKind.TIMEOUT
        detail = f"not finished after {seconds:g} s"
    elif ending.limit == "memory":
        status, kind = "out_of_memory", FaultKind.OUT_OF_MEMORY
        limit = mebibytes(memory_bytes or 0)
        detail = f"{mebibytes(ending.seen_bytes)} resident, the limit is {limit}"
    else:
        status, kind = "failed", FaultKind.PROCESS_ENDED
        detail = f"the process {ending.how}"
    seen = {"traceback": ending.said or None, "peak_memory_bytes": ending.seen_bytes or None}
    return not_ok(status, Fault(kind=kind, detail=detail), **seen)
