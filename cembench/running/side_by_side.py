"""Run checks in parallel, each in its own launcher. Timed rounds never run in parallel."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import AbstractContextManager
from queue import SimpleQueue
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from cembench.results.records import Outcome
from cembench.running.plan import Task

Found = tuple[Outcome, NDArray[np.complex128] | None]


class Checker(Protocol):
    """Checks one task at a time, and can be stopped."""

    def check(self, task: Task) -> Found:
        """Return the outcome of one call, and its map."""

    def stop(self) -> None:
        """End the running process, and start no other."""


C = TypeVar("C", bound=Checker)


def check_side_by_side(
    tasks: Sequence[Task],
    checkers: Sequence[C],
    watched: Callable[[Task], AbstractContextManager[object]],
) -> Iterator[tuple[Task, Found, C]]:
    """Check tasks in parallel; yield each with its outcome and its checker, as they end.

    As many run at a time as there are checkers. Anything that ends the iteration, including an
    interrupt, stops the running checks. `watched` is entered for each task while it is checked, by
    one thread at a time.
    """
    idle: SimpleQueue[C] = SimpleQueue()
    for checker in checkers:
        idle.put(checker)
    speaking = threading.Lock()

    def one(task: Task) -> tuple[Found, C]:
        checker = idle.get()
        try:
            return _check(checker, task)
        finally:
            idle.put(checker)

    def _check(checker: C, task: Task) -> tuple[Found, C]:
        watching = watched(task)
        with speaking:
            watching.__enter__()
        try:
            return checker.check(task), checker
        finally:
            with speaking:
                watching.__exit__(None, None, None)

    with ThreadPoolExecutor(len(checkers)) as pool:
        waiting = {pool.submit(one, task): task for task in tasks}
        try:
            for done in as_completed(waiting):
                yield waiting[done], *done.result()
        finally:
            for left in waiting:
                left.cancel()
            if not all(left.done() for left in waiting):
                for checker in checkers:
                    checker.stop()
