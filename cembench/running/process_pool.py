"""Call functions in several processes, which end with the block that uses them.

Functions, arguments and results are pickled. Each process is a fresh interpreter, so a script that
is run as the main program needs the usual ``if __name__ == "__main__"``: the command line has it.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context

from cembench.running.process import die_with_parent, limit_memory


@contextmanager
def process_pool(jobs: int, memory_bytes: int | None = None) -> Iterator[Executor]:
    """Yield an executor with `jobs` processes, each with a memory limit if one is given.

    An exception that leaves the block, Ctrl-C included, kills them at once.
    """
    others = {child.pid for child in active_children()}
    settings = (os.getpid(), memory_bytes)
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _set_up, settings)
    try:
        yield pool
    except BaseException:
        for child in active_children():
            if child.pid not in others:
                child.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _set_up(parent: int, memory_bytes: int | None) -> None:
    """Prepare a process: it ends with its parent, which alone handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent(parent)
    if memory_bytes is not None:
        limit_memory(memory_bytes)
