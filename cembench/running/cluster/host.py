"""One machine of a cluster: its stored files, and the lock for timing.

Several workers may stand on one machine. Their checks run side by side; while one of them times,
no other checks or times. A lock of the system holds that, so it ends with the process that has it,
and whoever started the workers need not know.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import time
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cembench.core.atomic import write
from cembench.core.errors import ClusterError, RecordError
from cembench.core.loading import is_there, read_arrays
from cembench.mesh.datasets import cache_directory

#: Days after which what nobody came back for is deleted from a machine.
KEPT_DAYS = 14.0
_KEPT = ("units", "surfaces", "plugins", "slurm")
Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]


class Turn:
    """The right to work on this machine: shared by checks, exclusive for timing.

    Examples
    --------
    >>> with Turn() as turn:
    ...     turn.share()
    ...     turn.alone()

    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or _common_folder() / "cembench-machine.lock"
        self._file = -1

    def __enter__(self) -> Self:
        """Open the lock's file, which all users of the machine have in common.

        Raises
        ------
        ClusterError
            It cannot be opened.

        """
        try:
            self._file = _opened(self.path)
        except OSError as error:
            raise ClusterError(
                f"{self.path}, by which the workers of a machine take turns, cannot be opened: "
                f"{error.strerror or error}. Let all users read it, or delete it."
            ) from error
        return self

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        os.close(self._file)

    def share(self) -> None:
        """Wait until nobody is timing, then keep others from timing."""
        self._lock(alone=False)

    def alone(self, waits: Callable[[], None] = lambda: None) -> None:
        """Wait until nobody else works, then keep others from working; call `waits` first."""
        if not self._lock(alone=True, at_once=True):
            waits()
            self._lock(alone=True)

    def _lock(self, *, alone: bool, at_once: bool = False) -> bool:
        try:
            import fcntl
        except ImportError:  # no such lock on Windows: one worker a machine, as the page says
            return True
        kind = fcntl.LOCK_EX if alone else fcntl.LOCK_SH
        fcntl.flock(self._file, fcntl.LOCK_UN)  # two who share must not wait for each other
        try:
            fcntl.flock(self._file, kind | (fcntl.LOCK_NB if at_once else 0))
        except BlockingIOError:
            return False
        return True


def _common_folder() -> Path:
    """Return a folder that all jobs and users of this machine have, whatever TMPDIR is."""
    common = Path("/tmp")
    return common if common.is_dir() else Path(tempfile.gettempdir())


def _opened(path: Path) -> int:
    """Open a file for locking, which may be another user's, and is made where there is none.

    Some systems refuse to open another user's file in a common folder in a way that would make it.
    """
    with suppress(FileNotFoundError):
        return os.open(path, os.O_RDONLY)
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
    except FileExistsError:  # made by another worker just now
        return os.open(path, os.O_RDONLY)
    path.chmod(0o644)  # whatever the user's umask is
    return file


def place() -> Path:
    """Return the folder in which this machine keeps surfaces, plug-ins and unfinished units."""
    return cache_directory() / "cluster"


def unit_folder(key: str) -> Path:
    """Return where a unit is measured on this machine."""
    return place() / "units" / key


def forget_units(keys: list[str]) -> None:
    """Delete what is kept of units whose records the client has."""
    for key in keys:
        shutil.rmtree(unit_folder(key), ignore_errors=True)


def kept_surface(mesh_hash: str) -> Arrays | None:
    """Return V and F of a surface that was sent before; None if it was not."""
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


def keep_surface(mesh_hash: str, arrays: Arrays) -> None:
    """Store a surface for the next unit that uses it."""
    V, F = arrays
    write(_surface_file(mesh_hash), lambda file: np.savez(file, V=V, F=F))


def _surface_file(mesh_hash: str) -> Path:
    return place() / "surfaces" / f"{mesh_hash[:32]}.npz"


def clear_old(days: float = KEPT_DAYS) -> None:
    """Delete surfaces and units that have not been used for a number of days."""
    since = time() - 86400 * days
    for old in (old for name in _KEPT for old in place().glob(f"{name}/*")):
        with suppress(OSError):
            if old.stat().st_mtime < since:
                shutil.rmtree(old) if old.is_dir() else old.unlink()
