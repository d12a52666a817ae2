"""Cases run in forked processes with limits, so that a hang or a crash is known by its case.

Limited are the seconds of processor time, so that a busy machine makes no hang, and the address
space. A generous limit of elapsed time catches a process that sleeps for ever.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Generic, TypeVar

C = TypeVar("C")

#: Elapsed seconds allowed for each second of processor time.
PATIENCE = 20
#: Seconds between two looks at the processes.
INTERVAL = 0.003
#: PR_SET_PDEATHSIG of <sys/prctl.h>.
_DIE_WITH_PARENT = 1


@dataclass(frozen=True)
class Limits:
    """What one case may take."""

    cpu_seconds: int = 10
    #: Beyond what the process has mapped when it is forked; None for no limit.
    memory_bytes: int | None = 3 * 2**30


@dataclass(frozen=True)
class Ending(Generic[C]):
    """How the process of one case ended."""

    case: C
    #: What the case returned; None where the process did not live to tell it.
    result: dict[str, Any] | None
    #: Why there is no result: "hang", "crash" or "instrument", the last with its traceback.
    failure: str | None
    detail: str
    seconds: float


@dataclass
class _Child(Generic[C]):
    """A process with the cases that it has not answered yet."""

    cases: list[C]
    pid: int
    answers: Path
    log: Path
    since: float
    read: int = 0


def run_cases(
    cases: Iterable[C],
    do: Callable[[C], dict[str, Any]],
    limits: Limits,
    slots: int,
    batch: int = 1,
) -> Iterator[Ending[C]]:
    """Yield how each case ended, in the order in which they end; `slots` processes at a time.

    `do` runs in a forked process, in a group of its own; what it leaves running is ended. A process
    takes `batch` cases one after the other; where it dies, the rest of them go to the next one.
    """
    waiting = iter(cases)
    left: list[list[C]] = []
    running: list[_Child[C]] = []
    with tempfile.TemporaryDirectory(prefix="fuzz-slots-") as folder:
        number = 0
        try:
            while True:
                while len(running) < slots:
                    chosen = left.pop() if left else list(islice(waiting, batch))
                    if not chosen:
                        break
                    number += 1
                    running.append(_start(chosen, do, limits, Path(folder) / str(number)))
                if not running:
                    return
                for child in list(running):
                    ended = os.waitpid(child.pid, os.WNOHANG)
                    yield from _answered(child)
                    last = _look(child, limits, *ended)
                    if last is not None:
                        running.remove(child)
                        if last.failure:
                            yield last
                            left.append(child.cases[1:])
                        left = [cases for cases in left if cases]
                time.sleep(INTERVAL)
        finally:
            for child in running:
                _end_group(child.pid)
                with suppress(ChildProcessError):
                    os.waitpid(child.pid, 0)


def _start(
    cases: list[C], do: Callable[[C], dict[str, Any]], limits: Limits, stem: Path
) -> _Child[C]:
    answers, log = stem.with_suffix(".jsonl"), stem.with_suffix(".log")
    answers.touch()
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if not pid:
        code = 70
        try:
            _confine(limits, log)
            with answers.open("a") as file:
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
            code = 0
        finally:
            os._exit(code)
    with suppress(OSError):  # the child did it first, or has ended
        os.setpgid(pid, pid)
    return _Child(list(cases), pid, answers, log, time.monotonic())


def _confine(limits: Limits, log: Path) -> None:
    os.setpgid(0, 0)
    handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    null = os.open(os.devnull, os.O_RDONLY)
    for target, source in ((0, null), (1, handle), (2, handle)):
        os.dup2(source, target)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
    if sys.platform == "linux" and limits.memory_bytes is not None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        size = pages * resource.getpagesize() + limits.memory_bytes
        resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _allow(seconds: int) -> None:
    """Let this process take so many more seconds of processor time."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    soft = int(used.ru_utime + used.ru_stime) + 1 + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _answered(child: _Child[C]) -> Iterator[Ending[C]]:
    """Yield what the process has answered since the last look."""
    with child.answers.open("rb") as file:
        file.seek(child.read)
        news = file.read()
    whole = news.rfind(b"\n") + 1
    child.read += whole
    for line in news[:whole].splitlines():
        answer = json.loads(line)
        case = child.cases.pop(0)
        child.since = time.monotonic()
        failed = "instrument" if "instrument" in answer else None
        detail = answer.get("instrument", "")
        yield Ending(case, answer.get("result"), failed, detail, answer["seconds"])


def _look(child: _Child[C], limits: Limits, pid: int, status: int) -> Ending[C] | None:
    """Return how the process ended, on its first case left if on any; None while it runs."""
    elapsed = time.monotonic() - child.since
    if not pid:
        if elapsed < PATIENCE * limits.cpu_seconds:
            return None
        _end_group(child.pid)
        os.waitpid(child.pid, 0)
        return _ending(child, "hang", f"still there after {elapsed:.0f} s", elapsed)
    _end_group(child.pid)
    code = os.waitstatus_to_exitcode(status)
    if not child.cases:
        return _ending(child, None, "", elapsed)
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        words = f"more than {limits.cpu_seconds} s of processor time"
        return _ending(child, "hang", words, elapsed)
    how = f"ended by {_signal(-code)}" if code < 0 else f"ended with code {code} and no answer"
    return _ending(child, "crash", how, elapsed)


def _ending(child: _Child[C], failure: str | None, detail: str, seconds: float) -> Ending[C]:
    said = child.log.read_text(errors="replace")[-2000:] if child.log.exists() else ""
    child.answers.unlink()
    child.log.unlink(missing_ok=True)
    case = child.cases[0] if child.cases else None
    words = "\n".join(filter(None, (detail, said)))
    return Ending(case, None, failure, words, seconds)  # type: ignore[arg-type]


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _end_group(pid: int) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)
