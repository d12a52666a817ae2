"""One machine of a cluster: its stored files, and the lock for timing.

Several workers may stand on one machine. Their checks run side by side; while one of them times,
no other checks or times. A lock of the system holds that, so it ends with the process that has it.
Each user has a lock of their own, which no other user can take.
"""

from __future__ import annotations

import errno
import os
import platform
import shutil
import stat
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
from cembench.core.names import file_name
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
        self.path = path or _lock_folder() / "machine.lock"
        self._file = -1

    def __enter__(self) -> Self:
        """Open the lock's file, which all workers of this user on the machine have in common.

        Raises
        ------
        ClusterError
            It cannot be opened, or is a link, or not a regular file of this user's.

        """
        try:
            self._file = _opened(self.path)
        except OSError as error:
            raise ClusterError(
                f"{self.path}, by which the workers of a machine take turns, cannot be opened: "
                f"{error.strerror or error}. Delete it, and let this user write to its folder."
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


def _lock_folder() -> Path:
    """Return a folder that all jobs of this user on this machine have, and nobody else writes to.

    It is in the folder for temporary files that all jobs have, whatever TMPDIR is. Whoever takes
    its name there before us stops nothing: then it is in the cache, by the machine's name.
    """
    common = Path("/tmp")
    above = common if common.is_dir() else Path(tempfile.gettempdir())
    folder = above / f"cembench-{_user()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        about = folder.lstat()
        if stat.S_ISDIR(about.st_mode) and about.st_uid == _user() and not about.st_mode & 0o022:
            return folder
    folder = place() / "locks" / file_name(platform.node())
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _user() -> int:
    """Return the number of this user; 0 where users have none (Windows)."""
    return os.geteuid() if hasattr(os, "geteuid") else 0


def _opened(path: Path) -> int:
    """Open a file for locking, which is made where there is none; nothing else is waited for."""
    flags = os.O_RDWR | os.O_CREAT
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    file = os.open(path, flags, 0o600)
    about = os.fstat(file)
    if not stat.S_ISREG(about.st_mode) or about.st_uid != _user():
        os.close(file)
        raise OSError(errno.EPERM, "it is not a regular file of this user's")
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
