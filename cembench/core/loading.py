"""Read files that may have been changed by others; every defect is a :class:`RecordError`.

Nothing is trusted. Only regular files are opened (a FIFO would block forever), an array is read
only if its header declares no more than memory can hold, and pickles are never loaded.
"""

from __future__ import annotations

import math
import stat
import warnings
import zipfile
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np
import psutil
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from cembench.core.errors import RecordError

T = TypeVar("T")

REMEDY = "Delete it and run again."


def damaged(path: Path, what: str, why: object) -> RecordError:
    """Return the error for a file with unexpected content."""
    return RecordError(f"{path} is not {what}: {why}. {REMEDY}")


#: Errors of file system calls; ValueError is raised for an impossible file name.
_REFUSED = (OSError, ValueError)


def unreadable(path: Path, error: Exception) -> RecordError:
    """Return the error for a file or folder that the system refuses to read."""
    why = getattr(error, "strerror", None) or error
    return RecordError(f"{str(path)!r} cannot be read: {why}. Check its name and permissions.")


def read_bytes(path: Path) -> bytes:
    """Return the content of a regular file.

    Raises
    ------
    RecordError
        The file is missing, is not a regular file, or may not be read.

    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise RecordError(f"{path} is not a regular file. Remove it and run again.")
        return path.read_bytes()
    except _REFUSED as error:
        raise unreadable(path, error) from error


def read_json(path: Path, schema: TypeAdapter[T], what: str) -> T:
    """Return the validated content of a JSON file; `what` names it in messages ("a record").

    Raises
    ------
    RecordError
        As for :func:`read_bytes`, or the content does not fit the schema.

    """
    content = read_bytes(path)
    try:
        return schema.validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise damaged(path, what, f"{place}: {first['msg']}" if place else first["msg"]) from error


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Return the named arrays of an ``.npz`` archive.

    Raises
    ------
    RecordError
        The archive is missing or damaged, lacks an array, or declares one that exceeds memory.

    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise RecordError(f"{path} is not a regular file. Remove it and run again.")
        with zipfile.ZipFile(path) as archive, warnings.catch_warnings(action="error"):
            return {name: _array(archive, name) for name in names}
    except RecordError:
        raise
    except OSError as error:
        raise unreadable(path, error) from error
    except Exception as error:  # a damaged archive makes the libraries raise anything
        why = str(error).strip(" .'\"") or type(error).__name__
        raise damaged(path, "an archive of arrays", why) from error


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Return one array of an archive, after comparing its header with its size and with memory."""
    member = archive.getinfo(f"{name}.npy")
    with archive.open(member) as file:
        shape, dtype = _header(file)
        announced = math.prod(shape) * dtype.itemsize
        if dtype.hasobject:
            raise ValueError(f"{name} is pickled; pickles are never read")
        if file.tell() + announced != member.file_size:
            raise ValueError(f"{name} declares {announced:,} bytes but holds a different number")
        if announced > psutil.virtual_memory().available:
            raise ValueError(f"{name} declares {announced:,} bytes, more than memory can hold")
    with archive.open(member) as file:
        array: NDArray[Any] = npy.read_array(file, allow_pickle=False)
        return array


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return the shape and type that the header of an ``.npy`` file declares."""
    version = npy.read_magic(file)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(file)
    return shape, dtype


def files_in(folder: Path, pattern: str) -> list[Path]:
    """Return the paths in a folder whose names match, sorted; none if the folder is missing.

    Raises
    ------
    RecordError
        It is not a folder, or cannot be listed (``Path.glob`` would silently find nothing).

    """
    try:
        found = [path for path in folder.iterdir() if fnmatch(path.name, pattern)]
    except FileNotFoundError:
        return []
    except _REFUSED as error:
        raise unreadable(folder, error) from error
    return sorted(found)


def is_there(path: Path) -> bool:
    """Whether a path exists; an unsearchable parent folder is an error.

    Raises
    ------
    RecordError
        The system does not answer (``Path.exists`` would return False, or raise).

    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except _REFUSED as error:
        raise unreadable(path, error) from error
    return True
