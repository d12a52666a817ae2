"""Run checks in parallel, each by its own checker. Timed rounds never run in parallel."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import AbstractContextManager
from queue import SimpleQueue
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cembench.results.records import Outcome
from cembench.running.plan import Task
from cembench.running.schedule import CellState

Checked = tuple[Outcome, NDArray[np.complex128] | None]


class Checker(Protocol):
    """Checks one task at a time, and can be stopped."""

    def check(self, task: Task) -> Checked:
        """Return the outcome of one call, and its map."""

    def stop(self) -> None:
        """End the running process, and start no other."""


def check_in_parallel(
    cells: Sequence[CellState],
    checkers: Sequence[Checker],
    watched: Callable[[CellState], AbstractContextManager[object]],
) -> Iterator[tuple[CellState, Checked]]:
    """Check cells in parallel; yield each with its outcome and its map, as they end.

    As many run at a time as there are checkers. Anything that ends the iteration, including an
    interrupt, stops the running checks. `watched` is entered for each cell while it is checked, by
    one thread at a time.
    """
    idle: SimpleQueue[Checker] = SimpleQueue()
    for checker in checkers:
        idle.put(checker)
    one_watches = threading.Lock()

    def check(state: CellState) -> Checked:
        checker = idle.get()
        watching = watched(state)
        try:
            with one_watches:
                watching.__enter__()
            try:
                return checker.check(state.task)
            finally:
                with one_watches:
                    watching.__exit__(None, None, None)
        finally:
            idle.put(checker)

    with ThreadPoolExecutor(len(checkers)) as pool:
        waiting = {pool.submit(check, state): state for state in cells}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        finally:
            for left in waiting:
                left.cancel()
            if not all(left.done() for left in waiting):
                for checker in checkers:
                    checker.stop()
