"""Check and time cells in processes of their own, and have their maps judged.

The first call of a process warms up, and counts for nothing but this: it gets a surface that the
process before has had. So what a new process makes of it is compared with what one did that had
been called before, and a map that was stored from call to call shows.
"""

from __future__ import annotations

import random
import threading
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from os import urandom
from pathlib import Path
from time import monotonic
from typing import Self

import numpy as np

from cembench.core.arrays import Complex
from cembench.core.names import file_name
from cembench.results.records import Fault, FaultKind, Outcome, Round, Status, not_ok
from cembench.running.estimate import expected_bytes
from cembench.running.launcher import Launcher, judges_server, mebibytes, save_array, unreadable
from cembench.running.map_checks import (
    SAME_MAP,
    SECOND_CALL,
    WARM_UP,
    Checked,
    JudgedCalls,
    difference,
    kept_from_call_to_call,
    sample,
)
from cembench.running.measure import ENOUGH_CALLS, LONG_CALL
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.rigid_motion import (
    DRAWN_LATER,
    NUMBERS_KEPT,
    THEN,
    UNMOVED,
    in_first_order,
    may_be,
)
from cembench.running.timing_checks import impossible, incomparable
from cembench.running.worker import Part, TimedPart

#: Number of new processes that are asked, at most, how far maps of a randomised solver scatter.
_MAX_ASKED = 3


@dataclass
class _History:
    """What the processes of a cell showed so far."""

    #: How often it was timed.
    timed: int = 0
    #: A call of the last process: its motion, and the file with a sample of its map.
    last: tuple[str, Path] | None = None
    #: Seconds of the first call of the last process.
    first_seconds: float = 0.0
    #: The largest difference between maps of the same surface by two new processes.
    scatter: float = 0.0


class CellTimer:
    """Checks and times cells, in processes that are forked where `forks` allows it.

    As soon as the event `stopped` is set, running processes end.
    """

    def __init__(
        self,
        scratch: Path,
        options: Options,
        *,
        forks: bool = True,
        stopped: threading.Event | None = None,
    ) -> None:
        self.launcher = Launcher(scratch, options, forks, stopped=stopped or threading.Event())
        self._cells: dict[str, _History] = {}
        self._numbering = urandom(6).hex()

    def for_checks(self, jobs: int) -> list[Self]:
        """Return `jobs` timers that may check at the same time, and add to what this one knows.

        Called in the thread in which the program ends: servers end with the thread that made them.
        """
        own = self.launcher
        share = own.options.memory_bytes and own.options.memory_bytes // jobs
        options = replace(own.options, memory_bytes=share)
        timers = []
        for number in range(1, jobs + 1):
            judges_server(number)
            timer = copy(self)
            scratch = own.scratch / f"checks-{number}"
            timer.launcher = Launcher(scratch, options, own.forks, number, own.stopped)
            timers.append(timer)
        return timers

    def stop(self) -> None:
        """End the running processes, and every later one right after its start."""
        self.launcher.stopped.set()

    def close(self) -> None:
        """End the server from which processes are forked; the next process gets a new one."""
        self.launcher.close()

    def check(self, task: Task) -> tuple[Outcome, Complex | None]:
        """Return the outcome of one call, and its map if it is finite and of the right shape.

        A large surface that needs more than the memory limit by estimate is not tried.
        """
        limit = self.launcher.options.memory_bytes
        expected = expected_bytes(task.cell.algorithm, task.mesh.m)
        if limit is not None and expected is not None and expected > limit:
            return not_ok("out_of_memory", _too_large(task.mesh.m, expected, limit)), None
        answer = self.launcher.run(task, "check", self.launcher.options.timeout)
        if answer.outcome is None:
            return unreadable("it holds no outcome"), None
        try:
            uv = self.launcher.read_uv(task)
        except (OSError, ValueError, EOFError) as error:
            return unreadable(f"its map: {error}"), None
        if uv is None:
            return answer.outcome, None
        judged = self.launcher.judge(task, "judge check", called=answer.outcome)
        if judged.outcome is None:
            return unreadable("its map could not be judged"), None
        self._remember(task, UNMOVED, uv)
        self._history(task).first_seconds = max(answer.outcome.seconds, default=0.0)
        return judged.outcome, uv

    def time(self, task: Task, checked: Checked) -> Round | Outcome:
        """Return the timed calls of one process, or the outcome if it has none."""
        rounds = self.together([task], [checked])
        return rounds if isinstance(rounds, Outcome) else rounds[0]

    def together(self, tasks: Sequence[Task], checked: Sequence[Checked]) -> list[Round] | Outcome:
        """Return the timed calls of these cells in one process, or the outcome if a cell has none.

        Each cell has calls, motions and judgements as in a process of its own. Which cell it was
        that used more than it may is not known where there are several.
        """
        parts = [self._part(number, task) for number, task in enumerate(tasks)]
        seconds = 2 * len(tasks) * self.launcher.options.timeout
        began = monotonic()
        answer = self.launcher.run(tasks[0], "time", seconds, parts=parts)
        ended = monotonic()
        used = answer.used
        if used is None or len(answer.parts) != len(parts):
            return answer.outcome or unreadable("it holds no round")
        for part, timed in zip(parts, answer.parts, strict=True):
            if not _as_asked(timed, part):
                return unreadable("it reports other calls than those requested")
        rounds = [timed.round for timed in answer.parts]
        used.wall = sum(sum(one.calls) for one in rounds)
        used.cold = sum(one.cold_seconds or 0.0 for one in rounds)
        for task, one in zip(tasks, rounds, strict=True):
            self._history(task).first_seconds = one.cold_seconds or one.calls[0]
        seen = (began, ended, answer.cpu_seconds)
        wrong = [fault for one in rounds for fault in impossible(used, one, *seen)]
        wrong = wrong or incomparable(used, answer.running, tasks[0].cell.threads)
        if wrong:
            return not_ok("not_comparable", *wrong)
        judged_rounds = []
        for task, known, part, timed in zip(tasks, checked, parts, answer.parts, strict=True):
            part.uv_file.replace(self.launcher.uv_file)
            judged = self._judge(task, known, timed)
            if isinstance(judged, Outcome):
                return judged
            about = judged.model_dump(include={"repeated", "energy", "differs"})
            about["motions"] = "; ".join(timed.motions)
            judged_rounds.append(timed.round.model_copy(update=about))
        return judged_rounds

    def _history(self, task: Task) -> _History:
        return self._cells.setdefault(task.cell.label, _History())

    def _part(self, number: int, task: Task) -> Part:
        """Return what the next process of a cell makes, alone or with others.

        Its surfaces are moved by motions that are drawn when their calls begin, and renumbered: in
        a round, the same call of all cells gets the same numbers, since seconds depend on them.
        Where calls are short, the first one, which only warms up, gets a motion that a call of the
        process before has had. A cell's first process makes another call that is not timed, whose
        surface keeps its numbers: what is stored by the triangles shows in its map. Where calls are
        long the first one may be timed, and a motion that another process has had is not timed.
        """
        history = self._history(task)
        is_first = not history.timed
        history.timed += 1
        ending = NUMBERS_KEPT if task.algorithm.target == "atlas" else ""
        numbering = f"{self._numbering}-{history.timed}"
        motions = [
            f"{numbering}-{call}{THEN}{DRAWN_LATER}{ending}" for call in range(ENOUGH_CALLS + 2)
        ]
        if is_first:
            motions[1] = f"{DRAWN_LATER}{NUMBERS_KEPT}"
        replays = history.last is not None and history.first_seconds <= LONG_CALL
        if history.last is not None and replays:
            motions[0] = history.last[0]
        return Part(
            cell=task.cell,
            plugins=task.plugins,
            motions=tuple(motions),
            first_counts=not replays,
            untimed=1 + is_first,
            uv_file=self.launcher.scratch / f"uv-{number}.npy",
        )

    def _judge(self, task: Task, checked: Checked, timed: TimedPart) -> JudgedCalls | Outcome:
        """Return the notices on the maps of a process, or an outcome if they are faulty."""
        last = self._history(task).last
        known = dict([last]) if last is not None else {}
        judged = self._judge_once(task, checked, timed, known)
        if isinstance(judged, JudgedCalls) and judged.doubtful is not None and not judged.faults:
            # For this surface or method, rounding decides between several maps.
            again = self._again(task, judged.doubtful)
            if isinstance(again, Outcome):
                return again
            row = self.launcher.scratch / f"{file_name(task.cell.label)}-again.npy"
            save_array(row, again)
            judged = self._judge_once(task, checked, timed, known | {judged.doubtful: row})
        if isinstance(judged, Outcome):
            return judged
        stored = judged.kept or self._stored_results(task, judged, timed)
        if judged.faults or stored:
            status: Status = "invalid" if judged.faults else "not_comparable"
            return not_ok(status, *judged.faults, *stored)
        # Of a cell's first process the call whose surface kept its numbers, else any timed one.
        first = int(timed.names[0] == WARM_UP)
        number = random.SystemRandom().randrange(first, len(timed.names))
        number = 1 if SECOND_CALL in timed.names else number
        self._remember(task, timed.motions[number], self._map_of_call(task, timed, number))
        return judged

    def _judge_once(
        self, task: Task, checked: Checked, timed: TimedPart, known: dict[str, Path]
    ) -> JudgedCalls | Outcome:
        answer = self.launcher.judge(
            task,
            "judge calls",
            checked=checked,
            names=timed.names,
            motions=timed.motions,
            known=known,
        )
        return answer.judged or answer.outcome or unreadable("its maps could not be judged")

    def _map_of_call(self, task: Task, timed: TimedPart, number: int) -> Complex:
        """Return the map of a call in the surface's own order."""
        rows = np.lib.format.open_memmap(self.launcher.uv_file, mode="r")
        return in_first_order(np.array(rows[number]), task.mesh, timed.motions[number])

    def _again(self, task: Task, motion: str) -> Complex | Outcome:
        """Return a sample of the map that a new process makes of the surface in this motion."""
        file = self.launcher.uv_file
        maps = file.with_name("maps.npy")
        file.replace(maps)
        again = self.launcher.run(task, "again", self.launcher.options.timeout, motions=(motion,))
        uv = self.launcher.read_uv(task)
        maps.replace(file)
        if uv is None:
            return again.outcome or unreadable("it holds no outcome")
        return sample(in_first_order(uv, task.mesh, motion))

    def _stored_results(
        self, task: Task, judged: JudgedCalls, timed: TimedPart
    ) -> tuple[Fault, ...]:
        """Return the fault that the process before stored something, if its maps show it.

        Where the maps of both processes differ, new ones are asked how far theirs do.
        """
        history, motion = self._history(task), timed.motions[0]
        if judged.difference is None or judged.faults or task.algorithm.program is not None:
            return ()
        if motion == UNMOVED:  # the check was a new process too
            history.scatter = judged.difference
            return ()
        for _ in range(_MAX_ASKED):
            if kept_from_call_to_call(judged.difference, history.scatter) is None:
                return ()
            again = self._again(task, motion)
            if isinstance(again, Outcome):
                return ()
            scatter = difference(sample(self._map_of_call(task, timed, 0)), again)
            history.scatter = max(scatter, history.scatter)
            if scatter <= SAME_MAP:
                break
        fault = kept_from_call_to_call(judged.difference, history.scatter)
        return () if fault is None else (fault,)

    def _remember(self, task: Task, motion: str, uv: Complex) -> None:
        """Store a sample of the map of this motion for the next process of the cell."""
        file = self.launcher.scratch / f"{file_name(task.cell.label)}.npy"
        save_array(file, sample(uv))
        self._history(task).last = (motion, file)


def _as_asked(timed: TimedPart, part: Part) -> bool:
    """Whether the motions of the calls are those that were asked for, in their order."""
    told = timed.motions
    every = len(told) == len(timed.names) == len(set(told))
    return every and len(told) <= len(part.motions) and all(map(may_be, told, part.motions))


def _too_large(faces: int, expected: float, limit: int) -> Fault:
    """Return the fault that a call was not started, since its memory would not suffice."""
    detail = (
        f"not started: {faces:,} triangles need about {mebibytes(expected)} by estimate, the limit "
        f"is {mebibytes(limit)}; a run can be given another one"
    )
    return Fault(kind=FaultKind.OUT_OF_MEMORY, detail=detail)
