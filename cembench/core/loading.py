"""Read files that may have been changed by others; every defect is a :class:`RecordError`.

Nothing is trusted. Only regular files are opened (a FIFO would block forever), an array is read
only if its header declares no more than memory can hold, and pickles are never loaded. Of a folder
that may come from elsewhere, `root`, no symbolic link is followed: it could lead to any file of the
reader's. The folder itself may be reached by one.
"""

from __future__ import annotations

import hashlib
import io
import math
import os
import stat
import warnings
import zipfile
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
import psutil
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from cembench.core.errors import RecordError

T = TypeVar("T")

REMEDY = "Delete it and run again."
#: Maximum bytes of the header of an ``.npy`` file, numpy's own limit and the few before it.
_LONGEST_HEADER = 10_016


def damaged(path: Path, what: str, why: object) -> RecordError:
    """Return the error for a file with unexpected content."""
    return advised(path, f"is not {what}: {why}.", REMEDY)


def advised(path: Path, text: str, remedy: str) -> RecordError:
    """Return the error for a file, with what to do about it."""
    return RecordError(f"{path} {text} {remedy}", f"{path.name} {text}")


#: Errors of file system calls; ValueError is raised for an impossible file name.
_REFUSED = (OSError, ValueError)


def unreadable(path: Path, error: Exception) -> RecordError:
    """Return the error for a file or folder that the system refuses to read."""
    why = getattr(error, "strerror", None) or error
    return RecordError(f"{str(path)!r} cannot be read: {why}. Check its name and permissions.")


def check_no_link(path: Path, root: Path) -> None:
    """Raise :class:`RecordError` if a path, or a folder between it and `root`, is a link."""
    inside = path.relative_to(root)
    for place in (path, *(root / parent for parent in inside.parents if parent.name)):
        if place.is_symlink():
            raise RecordError(
                f"{place} is a symbolic link, and none is followed in {root}: it could lead to a "
                "file that is not part of it. Put the file or folder itself in its place, or "
                "delete the link."
            )


def open_file(path: Path, root: Path | None = None, flags: int = os.O_RDONLY) -> int:
    """Open a regular file without waiting for a FIFO, and return its descriptor.

    Parameters
    ----------
    path : Path
        The file.
    root : Path, optional
        A folder that holds the file; below it no link is followed, even one that is made meanwhile.
    flags : int
        Flags of ``os.open``.

    Raises
    ------
    RecordError
        It is not a regular file, or a link leads to it.
    OSError
        The system refuses to open it.
    """
    flags |= getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    if root is None:
        return _regular(path, os.open(path, flags))
    check_no_link(path, root)
    if os.open not in os.supports_dir_fd:
        return _regular(path, os.open(path, flags))
    *folders, name = path.relative_to(root).parts
    handle = os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    try:
        for folder in folders:
            above = handle
            handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=above)
            os.close(above)
        return _regular(path, os.open(name, flags | os.O_NOFOLLOW, 0o666, dir_fd=handle))
    finally:
        os.close(handle)


def _regular(path: Path, handle: int) -> int:
    """Return the descriptor of a regular file; close any other."""
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise RecordError(f"{path} is not a regular file. Remove it and run again.")
    return handle


def _opened(path: Path, root: Path | None) -> BinaryIO:
    return os.fdopen(open_file(path, root), "rb")


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_bytes(path: Path, root: Path | None = None) -> bytes:
    """Return the content of a regular file; `root` as in :func:`open_file`.

    Raises
    ------
    RecordError
        The file is missing, is not a regular file, or may not be read, or a link leads to it.
    """
    try:
        with _opened(path, root) as file:
            return file.read()
    except _REFUSED as error:
        raise unreadable(path, error) from error


def read_json(path: Path, schema: TypeAdapter[T], what: str, root: Path | None = None) -> T:
    """Return the validated content of a JSON file; `what` names it in messages ("a record").

    Raises
    ------
    RecordError
        As for :func:`read_bytes`, or the content does not fit the schema.
    """
    content = read_bytes(path, root)
    try:
        return schema.validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise damaged(path, what, f"{place}: {first['msg']}" if place else first["msg"]) from error


def read_arrays(
    path: Path, names: Iterable[str], root: Path | None = None
) -> dict[str, NDArray[Any]]:
    """Return the named arrays of an ``.npz`` archive; `root` as in :func:`open_file`.

    Raises
    ------
    RecordError
        The archive is missing or damaged, lacks an array, or declares one that exceeds memory.
    """
    try:
        with (
            _opened(path, root) as file,
            zipfile.ZipFile(file) as archive,
            warnings.catch_warnings(action="error"),
        ):
            return arrays_of(archive, names)
    except RecordError:
        raise
    except OSError as error:
        raise unreadable(path, error) from error
    except Exception as error:  # a damaged archive makes the libraries raise anything
        why = str(error).strip(" .'\"") or type(error).__name__
        raise damaged(path, "an archive of arrays", why) from error


def arrays_of(
    archive: zipfile.ZipFile, names: Iterable[str], copies: int = 1
) -> dict[str, NDArray[Any]]:
    """Return arrays of an archive; memory must be able to hold `copies` copies of them.

    Nothing is unpacked before all sizes are known. Raises ValueError, :class:`TooLargeError` among
    them, or what the library raises on damaged bytes.
    """
    members = {name: archive.getinfo(f"{name}.npy") for name in names}
    for name in members:
        declared_array(archive, name)
    check_room(" and ".join(members), sum(m.file_size for m in members.values()), copies)
    arrays: dict[str, NDArray[Any]] = {}
    for name, member in members.items():
        with archive.open(member) as file:
            arrays[name] = npy.read_array(file, allow_pickle=False)
    return arrays


def declared_array(archive: zipfile.ZipFile, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return the shape and type of an array in an archive; its size is compared with them.

    Raises ValueError, or what the library raises on damaged bytes.
    """
    member = archive.getinfo(f"{name}.npy")
    with archive.open(member) as packed:
        file = io.BytesIO(packed.read(_LONGEST_HEADER))  # a header declares its length, too
    version = npy.read_magic(file)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject:
        raise ValueError(f"{name} is pickled; pickles are never read")
    announced = math.prod(shape) * dtype.itemsize
    if file.tell() + announced != member.file_size:
        raise ValueError(f"{name} declares {announced:,} bytes but holds a different number")
    return shape, dtype


class TooLargeError(ValueError):
    """What a file declares is more than memory can hold."""


def check_room(what: str, size: int, copies: int = 1) -> None:
    """Raise :class:`TooLargeError` if memory cannot hold this number of copies of `size` bytes."""
    if copies * size > free_memory():
        times = f" {copies} times, as reading and checking need" if copies > 1 else ""
        raise TooLargeError(
            f"{what} declares {size:,} bytes, more than memory can hold{times}: "
            f"{free_memory():,} bytes are free"
        )


def free_memory() -> int:
    """Return how many bytes of memory are free on this machine."""
    return int(psutil.virtual_memory().available)


def files_in(folder: Path, pattern: str, root: Path | None = None) -> list[Path]:
    """Return the paths in a folder whose names match, sorted; none if the folder is missing.

    Raises
    ------
    RecordError
        It is not a folder, or cannot be listed (``Path.glob`` would silently find nothing), or a
        link below `root` leads to it.
    """
    try:
        if root is not None:
            check_no_link(folder, root)
        files = [path for path in folder.iterdir() if fnmatch(path.name, pattern)]
    except FileNotFoundError:
        return []
    except _REFUSED as error:
        raise unreadable(folder, error) from error
    return sorted(files)


def is_there(path: Path) -> bool:
    """Whether a path exists, be it a link to nothing; an unsearchable parent folder is an error.

    Raises
    ------
    RecordError
        The system does not answer (``Path.exists`` would return False, or raise).
    """
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except _REFUSED as error:
        raise unreadable(path, error) from error
    return True
