"""The files that a worker stores on its machine, and the lock that one worker at a time holds."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time

from filelock import FileLock, Timeout

from cembench.core.errors import ClusterError
from cembench.core.names import file_name
from cembench.mesh.datasets import cache_directory
from cembench.running.environment import machine_name

#: Days after which unused files are deleted from a machine.
KEPT_DAYS = 14.0
#: Seconds between two attempts to take the lock of a machine.
POLL_SECONDS = 1.0


@contextmanager
def machine_lock(waiting: Callable[[], None]) -> Iterator[None]:
    """Hold the lock of this machine, so that no other worker of this user measures here meanwhile.

    `waiting` is called every second while another worker holds the lock; it may raise. The system
    releases the lock of a process that is killed.
    """
    path = place() / "locks" / f"{file_name(machine_name())}.lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path)
        while not lock.is_locked:
            try:
                lock.acquire(timeout=POLL_SECONDS)
            except Timeout:
                waiting()
    except OSError as error:
        raise ClusterError(
            f"the lock of this machine, {path}, cannot be opened: {error.strerror or error}. Set "
            "CEMBENCH_CACHE to a folder that this user can write to."
        ) from error
    try:
        yield
    finally:
        lock.release()


def place() -> Path:
    """Return the folder for plug-ins and unfinished units on this machine."""
    return cache_directory() / "cluster"


def unit_folder(key: str) -> Path:
    """Return the folder of a unit that is measured on this machine."""
    return place() / "units" / key


def forget_unit(key: str) -> None:
    """Delete the folder of a unit."""
    shutil.rmtree(unit_folder(key), ignore_errors=True)


def clear_old(days: float = KEPT_DAYS) -> None:
    """Delete units and plug-ins that have not been used for a number of days."""
    since = time() - 86400 * days
    for old in (old for name in ("units", "plugins", "slurm") for old in place().glob(f"{name}/*")):
        with suppress(OSError):
            if old.stat().st_mtime < since:
                shutil.rmtree(old) if old.is_dir() else old.unlink()
