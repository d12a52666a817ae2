"""Run checks in parallel, each by its own timer. Timed rounds never run in parallel."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import AbstractContextManager
from queue import SimpleQueue

from cembench.core.arrays import Complex
from cembench.results.records import Outcome
from cembench.running.schedule import CellState
from cembench.running.timing import CellTimer

Checked = tuple[Outcome, Complex | None]


def check_in_parallel(
    cells: Sequence[CellState],
    timers: Sequence[CellTimer],
    watched: Callable[[CellState], AbstractContextManager[object]],
) -> Iterator[tuple[CellState, Checked]]:
    """Check cells in parallel; yield each with its outcome and its map, as they end.

    As many run at a time as there are `timers`. Anything that ends the iteration, including an
    interrupt, stops the running checks. `watched` is entered for each cell while it is checked, by
    one thread at a time.
    """
    idle: SimpleQueue[CellTimer] = SimpleQueue()
    for timer in timers:
        idle.put(timer)
    one_watches = threading.Lock()

    def check(state: CellState) -> Checked:
        timer = idle.get()
        watching = watched(state)
        try:
            with one_watches:
                watching.__enter__()
            try:
                return timer.check(state.task)
            finally:
                with one_watches:
                    watching.__exit__(None, None, None)
        finally:
            idle.put(timer)

    with ThreadPoolExecutor(len(timers)) as pool:
        waiting = {pool.submit(check, state): state for state in cells}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        finally:
            for left in waiting:
                left.cancel()
            if not all(left.done() for left in waiting):
                for timer in timers:
                    timer.stop()
