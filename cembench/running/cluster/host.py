"""The files that a worker stores on its machine, and the lock that one worker at a time holds."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from cembench.core.atomic import write
from cembench.core.errors import ClusterError, RecordError
from cembench.core.loading import is_there, read_arrays
from cembench.core.names import file_name
from cembench.mesh.datasets import cache_directory
from cembench.running.environment import machine_name

#: Days after which unused files are deleted from a machine.
KEPT_DAYS = 14.0
_CLEARED = ("units", "surfaces", "plugins", "slurm")
#: Seconds between two attempts to take the lock of a machine.
LOOK_EVERY = 1.0
Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]


@contextmanager
def machine_lock(waiting: Callable[[], None]) -> Iterator[None]:
    """Hold the lock of this machine, so that no other worker of this user measures here meanwhile.

    `waiting` is called every second while another worker holds the lock; it may raise. The system
    releases the lock of a process that is killed.

    Raises
    ------
    ClusterError
        The lock cannot be opened.

    Examples
    --------
    >>> with machine_lock(lambda: None):
    ...     pass

    """
    path = place() / "locks" / f"{file_name(machine_name())}.lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path)
        while not lock.is_locked:
            try:
                lock.acquire(timeout=LOOK_EVERY)
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
    """Return the folder for surfaces, plug-ins and unfinished units on this machine."""
    return cache_directory() / "cluster"


def unit_folder(key: str) -> Path:
    """Return the folder of a unit that is measured on this machine."""
    return place() / "units" / key


def forget_unit(key: str) -> None:
    """Delete the folder of a unit."""
    shutil.rmtree(unit_folder(key), ignore_errors=True)


def stored_surface(mesh_hash: str) -> Arrays | None:
    """Return V and F of a surface stored by :func:`store_surface`; None if there is none."""
    path = _surface_file(mesh_hash)
    if not is_there(path):
        return None
    try:
        data = read_arrays(path, ("V", "F"))
    except RecordError:
        path.unlink(missing_ok=True)  # it is sent again
        return None
    os.utime(path)
    return data["V"], data["F"]


def store_surface(mesh_hash: str, arrays: Arrays) -> None:
    """Store a surface for the next unit that uses it."""
    V, F = arrays
    write(_surface_file(mesh_hash), lambda file: np.savez(file, V=V, F=F))


def _surface_file(mesh_hash: str) -> Path:
    return place() / "surfaces" / f"{mesh_hash[:32]}.npz"


def clear_old(days: float = KEPT_DAYS) -> None:
    """Delete surfaces and units that have not been used for a number of days."""
    since = time() - 86400 * days
    for old in (old for name in _CLEARED for old in place().glob(f"{name}/*")):
        with suppress(OSError):
            if old.stat().st_mtime < since:
                shutil.rmtree(old) if old.is_dir() else old.unlink()
