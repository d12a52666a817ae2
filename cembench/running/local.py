"""Run cells on this machine, each in a process of its own, one after the other."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.records import Outcome, Record
from cembench.running.environment import describe_environment, with_threads
from cembench.running.plan import Task
from cembench.store import Store

#: Wall-clock seconds that a cell may take unless the user says otherwise.
DEFAULT_TIMEOUT = 600.0

Result = tuple[Record, NDArray[np.complex128] | None]


def run_tasks(
    tasks: Iterable[Task],
    store: Store | None = None,
    *,
    timeout: float = DEFAULT_TIMEOUT,
    fresh: bool = False,
    before: Callable[[Task], None] = lambda task: None,
) -> Iterator[tuple[Task, Record, NDArray[np.complex128] | None, bool]]:
    """Measure the tasks one by one; yields each with its record, map, and whether it is resumed.

    With a store, a cell that it already holds is not measured again unless `fresh`, and each new
    record is on disk before the next cell starts. `before` is called as a task is taken up.
    """
    environment = describe_environment()
    for task in tasks:
        before(task)
        kept = None if fresh or store is None else store.find(task.cell)
        if kept is not None and store is not None:
            yield task, kept, store.uv(task.cell), True
            continue
        record, uv = run_task(task, environment, timeout=timeout)
        if store is not None:
            store.save(record, uv, environment)
        yield task, record, uv, False


def run_task(task: Task, environment: dict[str, Any], *, timeout: float) -> Result:
    """Measure one task in a process of its own; whatever happens to that, there is a record."""
    started = datetime.now(UTC).isoformat(timespec="seconds")
    with tempfile.TemporaryDirectory(prefix="cembench-cell-") as name:
        folder = Path(name)
        np.savez(folder / "mesh.npz", V=task.mesh.V, F=task.mesh.F)
        job = {
            "cell": task.cell.model_dump(),
            "plugins": task.plugins,
            "mesh_type": type(task.mesh).__name__,
            "notices": task.mesh.notices,
        }
        (folder / "job.json").write_text(json.dumps(job))
        outcome = _outcome_of_process(folder, task.cell.threads, timeout)
        uv = None
        if (folder / "uv.npz").exists() and outcome.metrics:
            with np.load(folder / "uv.npz") as archive:
                uv = np.asarray(archive["uv"])
    record = Record(
        cell=task.cell,
        title=task.algorithm.title,
        target=task.algorithm.target,
        mesh=task.facts,
        outcome=outcome,
        environment=environment["id"],
        started_at=started,
    )
    return record, uv


def _outcome_of_process(folder: Path, threads: int, timeout: float) -> Outcome:
    log = folder / "log.txt"
    with log.open("wb") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "cembench.running.worker", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=with_threads(threads),
            start_new_session=True,  # so that its children can be ended with it
        )
        try:
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            return Outcome(status="timeout", cause=f"not finished after {timeout:g} s")
        finally:
            _end_group(process)
    if code == 0 and (folder / "outcome.json").exists():
        return Outcome.model_validate_json((folder / "outcome.json").read_bytes())
    said = log.read_bytes()[-4000:].decode(errors="replace").strip()
    if code < 0:
        cause = f"the process was ended by signal {signal.Signals(-code).name}"
    else:
        cause = f"the process ended with code {code}" + (
            f": {said.splitlines()[-1]}" if said else ""
        )
    return Outcome(status="failed", cause=cause, traceback=said or None)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """End the process with all that it started, also when it has ended itself."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
