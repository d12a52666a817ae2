"""Cases run in forked processes under limits, so that a hang or a crash is known by its case.

Limited are the seconds of processor time, so that a busy machine makes no hang, and the memory that
a process may reserve. A generous limit of elapsed time catches a process that sleeps for ever.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Generic, TypeVar

from cembench.running import process
from cembench.running.process import Start, die_with_parent, limit_memory, run_limited

C = TypeVar("C")

#: Elapsed seconds allowed for each second of processor time.
PATIENCE = 20


@dataclass(frozen=True)
class Limits:
    """What one case may take."""

    cpu_seconds: int = 10
    #: For :func:`cembench.running.process.limit_memory`, which lets 3.25 GiB of this be reserved,
    #: 3 of them beyond what the process has when it is forked; None for no limit.
    memory_bytes: int | None = 3 * 2**29


@dataclass(frozen=True)
class Ending(Generic[C]):
    """How one case ended."""

    case: C
    #: What the case returned; None where its process did not live to return it.
    result: dict[str, Any] | None
    #: Why there is no result: "hang", "crash" or "instrument", the last with its traceback.
    failure: str | None
    detail: str
    seconds: float


def run_cases(
    cases: Iterable[C],
    do: Callable[[C], dict[str, Any]],
    limits: Limits,
    slots: int,
    batch: int = 1,
) -> Iterator[Ending[C]]:
    """Yield how each case ended, in the order in which their batches end; `slots` at a time.

    `do` runs in a forked process; what it leaves running is ended. A process takes `batch` cases
    one after the other; where it dies, the rest of them go to the next one.
    """
    waiting = iter(cases)
    batches = iter(lambda: list(islice(waiting, batch)), [])
    with ProcessPoolExecutor(slots, get_context("fork"), _prepare, (os.getpid(),)) as pool:
        _WORK[:] = [do, limits]  # the pool's processes are forked at the first submission
        pending = {pool.submit(_run_batch, one) for one in islice(batches, slots)}
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield from future.result()
                pending |= {pool.submit(_run_batch, one) for one in islice(batches, 1)}


#: The function of the cases and their limits, inherited by the pool's processes.
_WORK: list[Any] = []


def _prepare(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent(parent)


def _run_batch(cases: list[C]) -> list[Ending[C]]:
    do, limits = _WORK
    endings: list[Ending[C]] = []
    while len(endings) < len(cases):
        endings += _run_process(cases[len(endings) :], do, limits)
    return endings


def _run_process(
    cases: list[C], do: Callable[[C], dict[str, Any]], limits: Limits
) -> Iterator[Ending[C]]:
    """Yield how the cases ended that one process took; the last one may have ended it."""
    with tempfile.TemporaryDirectory(prefix="fuzz-slot-") as folder:
        answers = Path(folder) / "answers.jsonl"
        answers.touch()

        def seconds() -> float:
            return time.time() - answers.stat().st_mtime

        end = run_limited(
            _forking(cases, do, limits, answers),
            process.Limits(math.inf),
            Path(folder) / "log",
            alone=True,  # its group is ended all the same; a search among all processes is slow
            stopped=lambda: seconds() > PATIENCE * limits.cpu_seconds,
        )
        taken, lines = seconds(), answers.read_bytes().splitlines(keepends=True)
    whole = [json.loads(line) for line in lines if line.endswith(b"\n")]
    for case, answer in zip(cases, whole, strict=False):
        detail = answer.get("instrument", "")
        failure = "instrument" if detail else None
        yield Ending(case, answer.get("result"), failure, detail, answer["seconds"])
    if len(whole) < len(cases):
        hung = end.code in (-signal.SIGXCPU, -signal.SIGKILL)
        how = f"more than {limits.cpu_seconds} s of processor time" if hung else f"it {end.how}"
        detail = f"{how}\n{end.said}".strip()
        yield Ending(cases[len(whole)], None, "hang" if hung else "crash", detail, taken)


def _forking(
    cases: list[C], do: Callable[[C], dict[str, Any]], limits: Limits, answers: Path
) -> Start:
    """Return a function for `run_limited` that forks a process for the cases."""

    def start(mark: str, log: Path) -> _Forked:
        parent = os.getpid()
        sys.stdout.flush()
        sys.stderr.flush()
        pid = os.fork()
        if pid:
            return _Forked(pid)
        try:
            _confine(limits, log, parent)
            with answers.open("a", encoding="utf-8") as file:
                for case in cases:
                    _allow(limits.cpu_seconds)
                    started = time.monotonic()
                    try:
                        answer: dict[str, Any] = {"result": do(case)}
                    except BaseException:
                        answer = {"instrument": traceback.format_exc()}
                    answer["seconds"] = time.monotonic() - started
                    file.write(json.dumps(answer) + "\n")
                    file.flush()
        finally:
            os._exit(70)  # also of a case that raises what nobody expects

    return start


@dataclass
class _Forked:
    """A forked process, with the part of the interface of `Popen` that `run_limited` uses."""

    pid: int
    code: int | None = None

    def poll(self) -> int | None:
        """Return the exit code; None while the process runs."""
        return self._waited(os.WNOHANG)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the process to end, and return the exit code."""
        code = self._waited(0)
        assert code is not None
        return code

    def kill(self) -> None:
        """Kill the process if it is running."""
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)

    def _waited(self, options: int) -> int | None:
        if self.code is None:
            pid, status = os.waitpid(self.pid, options)
            self.code = os.waitstatus_to_exitcode(status) if pid else None
        return self.code


def _confine(limits: Limits, log: Path, parent: int) -> None:
    os.setsid()
    handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    null = os.open(os.devnull, os.O_RDONLY)
    for target, source in ((0, null), (1, handle), (2, handle)):
        os.dup2(source, target)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    die_with_parent(parent)
    if limits.memory_bytes is not None:
        limit_memory(limits.memory_bytes)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _allow(seconds: int) -> None:
    """Let this process take so many more seconds of processor time."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    soft = int(used.ru_utime + used.ru_stime) + 1 + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))
