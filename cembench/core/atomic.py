"""Files that are whole or not there: everything that the project writes to stay is written here.

A draft beside the place takes the content. It is flushed to disk, checked, and only then given its
name; whatever fails leaves what was there. The name of a draft says which file it is for and which
process writes it, so that the next one to write the same file clears away what a kill left.
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
#: Drafts of runs that were made before drafts said whose they are.
_OLDER_DRAFT = re.compile(r"\.draft-[0-9a-f]{32}")
#: What the system says when no more fits: then another folder on the same disk is no remedy.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def read_model(path: Path, model: type[M]) -> M:
    """Read what :func:`write_model` wrote; :class:`RecordError` says which file is damaged."""
    noun = model.__name__.lower()
    return read_json(path, TypeAdapter(model), f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}")


def write_model(path: Path, model: BaseModel) -> None:
    """Write a model as JSON."""
    write_bytes(path, model.model_dump_json(indent=2).encode())


def write_bytes(
    path: Path,
    content: bytes,
    *,
    error: type[CembenchError] = RecordError,
    parents: bool = True,
) -> None:
    """Write content; as :func:`write`."""
    write(path, lambda file: file.write(content), error=error, parents=parents)


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8, with escapes for what is no character, as in names of files."""
    write_bytes(path, text.encode(errors="backslashreplace"))


def write(
    path: Path,
    fill: Callable[[BinaryIO], object],
    *,
    check: Callable[[Path], object] = lambda draft: None,
    error: type[CembenchError] = RecordError,
    parents: bool = True,
) -> None:
    """Let `fill` write to a file that was opened for it; as :func:`write_by` in all else.

    All bytes must have arrived, also where a library that `fill` calls drops an error.
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
    """Let `make` write a draft, flush it to disk, check it, and only then give it its name.

    Who may read it is up to the user's umask, as for any file.

    Parameters
    ----------
    path : Path
        The file. One that is there is replaced; a symbolic link is replaced and not followed.
    make : function of a path
        Writes the draft; for libraries that open their files themselves.
    check : function of a path
        Raises OSError where the draft does not hold what it should.
    error : class
        What is raised where the file cannot be written.
    parents : bool
        Whether folders that are missing are made.

    Raises
    ------
    `error`
        The disk is full, or the place cannot be written to.

    """
    try:
        if path.exists() and not path.is_file():
            what = "is a folder" if path.is_dir() else "is not a regular file"
            raise OSError(errno.EEXIST, f"it {what}")
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        draft = _new_draft(path, path.suffix.lower())
        try:
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
    """Give an empty folder beside a file or folder, for what will be moved there; gone at the end.

    Raises OSError where it cannot be made.
    """
    draft = _new_draft(path, "")
    draft.mkdir()
    try:
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def clear_drafts(folder: Path, of: Path | None = None) -> None:
    """Delete the drafts in a folder whose processes have ended; only those `of` one file, if given.

    Without `of` the folder must be one that we made: older drafts are deleted by their names alone.
    """
    for path in folder.glob(".draft-*"):
        named = _DRAFT.fullmatch(path.name)
        if named is None:
            if of is None and _OLDER_DRAFT.fullmatch(path.name) and path.is_file():
                path.unlink(missing_ok=True)
            continue
        if (of is None or named[1] == digest(of.name)[:12]) and not _runs(int(named[2])):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def is_draft(path: Path) -> bool:
    """Whether a file has the name of a draft."""
    return bool(_DRAFT.fullmatch(path.name) or _OLDER_DRAFT.fullmatch(path.name))


def unwritable(
    path: Path, error: OSError, kind: type[CembenchError] = RecordError
) -> CembenchError:
    """Return the error to raise for a file that could not be written."""
    remedy = (
        "Make room there, or choose a place on another disk."
        if error.errno in _FULL
        else "Choose another place."
    )
    return kind(f"{path} cannot be written: {error.strerror or error}. {remedy}")


def flush_folder(folder: Path) -> None:
    """Let new names in a folder reach the disk too, where the system can do that.

    Without it a power cut, unlike a kill, can take back the last files that :func:`write` named.
    """
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _new_draft(path: Path, suffix: str) -> Path:
    """Return a path beside `path` that nothing has; drafts that a kill left of it are cleared."""
    clear_drafts(path.parent, of=path)
    suffix = suffix if re.fullmatch(r"\.\w{1,20}", suffix) else ""
    name = f".draft-{digest(path.name)[:12]}-{os.getpid()}-{uuid.uuid4().hex}{suffix}"
    return path.parent / name


def _runs(pid: int) -> bool:
    import psutil  # here, as it is needed only where something was left

    return bool(psutil.pid_exists(pid))


def _fill(draft: Path, fill: Callable[[BinaryIO], object]) -> None:
    opened = draft.open("xb")
    file = _Draft(opened)
    try:
        try:
            fill(cast(BinaryIO, file))
        except Exception:
            if file.failure is None:
                raise  # not the disk
        if file.failure is not None:
            raise file.failure
        opened.flush()
        arrived = os.fstat(opened.fileno()).st_size
        if arrived != file.end:
            raise OSError(errno.EIO, f"{arrived} of {file.end} bytes arrived")
    finally:
        with suppress(OSError):  # what was said before counts
            file.close()  # or it would be closed when it is deleted, and find `opened` closed
        with suppress(OSError):
            opened.close()


class _Draft(io.BufferedIOBase):
    """A file that keeps the first error and from then on takes whatever it is given.

    Libraries drop errors, or meet the next one while they tidy up after the first: a ZIP archive,
    for one, is completed when it is deleted, where nobody can catch anything.
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
