"""Atomic writes: a file is complete or absent. Everything the project keeps is written here.

The content goes to a draft in the same folder. The draft is flushed to disk, checked and then
renamed; if anything fails, the previous file stays. A draft's name holds the name of its file and
the process that writes it, so that the next writer of that file can delete what a kill left behind.
"""

from __future__ import annotations

import errno
import io
import os
import re
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, TypeVar, cast

from pydantic import BaseModel, TypeAdapter

from cembench.core.errors import CembenchError, RecordError
from cembench.core.loading import read_json
from cembench.core.names import digest

M = TypeVar("M", bound=BaseModel)

_DRAFT = re.compile(r"\.draft-([0-9a-f]{12})-(\d+)-[0-9a-f]{32}(\.\w+)?")
#: The bits of a file's mode that say who may read, write and execute it.
_PERMISSIONS = 0o777
#: Error codes of a full disk or quota: another folder on the same disk would not help.
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
FREE_SPACE = "Free some space, or choose a path on another disk."


def read_model(path: Path, model: type[M], root: Path | None = None) -> M:
    """Read what :func:`write_model` wrote; a :class:`RecordError` names a damaged file.

    `root` is as in :func:`cembench.core.loading.open_file`.
    """
    noun = model.__name__.lower()
    what = f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"
    return read_json(path, TypeAdapter(model), what, root)


def write_model(path: Path, model: BaseModel) -> None:
    """Write a model as JSON."""
    write_bytes(path, model.model_dump_json(indent=2).encode())


def write_bytes(
    path: Path, content: bytes, *, error: type[CembenchError] = RecordError, parents: bool = True
) -> None:
    """Write bytes to a file; options as for :func:`write`."""
    write(path, lambda file: file.write(content), error=error, parents=parents)


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8; lone surrogates, as in file names, become escapes."""
    write_bytes(path, text.encode(errors="backslashreplace"))


def write(
    path: Path,
    fill: Callable[[BinaryIO], object],
    *,
    check: Callable[[Path], object] = lambda draft: None,
    error: type[CembenchError] = RecordError,
    parents: bool = True,
) -> None:
    """Write a file atomically by calling `fill` with it opened; options as for :func:`write_by`.

    The size is checked afterwards, because a library that `fill` calls may drop an error.
    """
    write_by(path, lambda draft: _fill(draft, fill), check=check, error=error, parents=parents)


def write_by(
    path: Path,
    make: Callable[[Path], object],
    *,
    check: Callable[[Path], object] = lambda draft: None,
    error: type[CembenchError] = RecordError,
    parents: bool = True,
) -> None:
    """Write a file atomically: `make` writes a draft, which is flushed, checked and renamed.

    A new file's permissions follow the user's umask; a file that is replaced keeps its own.

    Parameters
    ----------
    path : Path
        The file. An existing one is replaced; a symbolic link is replaced, not followed.
    make : callable
        Writes the draft at the path it is given; for libraries that open their files themselves.
    check : callable
        Raises OSError if the draft at the path it is given is incomplete.
    error : class
        Raised if the file cannot be written.
    parents : bool
        Whether to create missing parent folders.

    Raises
    ------
    `error`
        The disk is full, or the folder is not writable.
    """
    try:
        if path.exists() and not path.is_file():
            what = "is a folder" if path.is_dir() else "is not a regular file"
            raise OSError(errno.EEXIST, f"it {what}")
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        draft = _new_draft(path, path.suffix.lower())
        try:
            draft.touch(exist_ok=False)
            if path.is_file() and not path.is_symlink():
                draft.chmod(path.stat().st_mode & _PERMISSIONS)  # before it holds anything
            make(draft)
            with draft.open("rb+") as file:
                os.fsync(file.fileno())
            check(draft)
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as failure:
        raise unwritable(path, failure, error) from failure


@contextmanager
def draft_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path` to prepare content in; it is deleted at the end.

    Raises OSError if it cannot be created.
    """
    draft = _new_draft(path, "")
    draft.mkdir()
    try:
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def clear_drafts(folder: Path, of: Path | None = None) -> None:
    """Delete drafts in a folder whose processes have ended; only those `of` one file, if given."""
    for path in folder.glob(".draft-*"):
        named = _DRAFT.fullmatch(path.name)
        if named is None:
            continue
        if (of is None or named[1] == digest(of.name)[:12]) and not _runs(int(named[2])):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def is_draft(path: Path) -> bool:
    """Whether a path has the name of a draft."""
    return _DRAFT.fullmatch(path.name) is not None


def unwritable(
    path: Path, error: OSError, kind: type[CembenchError] = RecordError
) -> CembenchError:
    """Return the error for a file that could not be written."""
    remedy = FREE_SPACE if error.errno in FULL else "Choose another path."
    return kind(f"{path} cannot be written: {error.strerror or error}. {remedy}")


def flush_folder(folder: Path) -> None:
    """Flush the names in a folder to disk, where the system supports that.

    Without it a power cut, unlike a kill, can lose the last files that :func:`write` renamed.
    """
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _new_draft(path: Path, suffix: str) -> Path:
    """Return an unused draft path for `path`, after deleting drafts that a kill left of it."""
    clear_drafts(path.parent, of=path)
    suffix = suffix if re.fullmatch(r"\.\w{1,20}", suffix) else ""
    name = f".draft-{digest(path.name)[:12]}-{os.getpid()}-{uuid.uuid4().hex}{suffix}"
    return path.parent / name


def _runs(pid: int) -> bool:
    """Whether a process with this id is running."""
    import psutil  # imported here: needed only if a draft was left behind

    return bool(psutil.pid_exists(pid))


def _fill(draft: Path, fill: Callable[[BinaryIO], object]) -> None:
    """Write a draft by `fill`, and raise its first disk error even if `fill` drops it."""
    opened = draft.open("wb")
    file = _Draft(opened)
    try:
        try:
            fill(cast(BinaryIO, file))
        except Exception:
            if file.failure is None:
                raise  # not an error of the disk
        if file.failure is not None:
            raise file.failure
        opened.flush()
        arrived = os.fstat(opened.fileno()).st_size
        if arrived != file.end:
            raise OSError(errno.EIO, f"{arrived} of {file.end} bytes were written")
    finally:
        with suppress(OSError):  # the first error counts
            file.close()  # otherwise its deletion would close `opened` a second time
        with suppress(OSError):
            opened.close()


class _Draft(io.BufferedIOBase):
    """A file that keeps its first error and silently accepts all further writes.

    Libraries drop errors, or raise further ones while they clean up after the first. A ZIP archive,
    for example, is completed when it is deleted, where no exception can be caught.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.failure: OSError | None = None
        self.end = 0
        self._place = 0

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._place

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        if self.failure is None:
            self._place = self._tried(lambda: self.file.seek(offset, whence))
        return self._place

    def write(self, data: Any) -> int:
        count = memoryview(data).nbytes
        if self.failure is None:
            self._tried(lambda: self.file.write(data))
        self._place += count
        self.end = max(self.end, self._place)
        return count

    def flush(self) -> None:
        if self.failure is None:
            self._tried(self.file.flush)

    def _tried(self, action: Callable[[], Any]) -> Any:
        try:
            return action()
        except OSError as error:
            self.failure = error
            raise
