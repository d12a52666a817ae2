"""Folders that cembench creates, recognised by a marker file.

Nothing is written into a folder that holds other files, unless it has a marker. The marker of a
report also lists the report's files with their hashes; only those are replaced or deleted.
"""

from __future__ import annotations

import uuid
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Literal

from pydantic import BaseModel, Field, ValidationError

from cembench.core.atomic import is_draft, unwritable, write_text
from cembench.core.errors import RecordError
from cembench.core.loading import sha256_of

#: Kinds of folders that cembench creates.
Kind = Literal["run", "report", "validation"]
#: Name of the marker file.
MARKERS: dict[Kind, str] = {
    "run": "cembench.json",
    "report": "contents.json",
    "validation": "cembench.json",
}
#: At most this many conflicting files are named in a message.
_NAMED = 3


class Marker(BaseModel):
    """The kind of a folder and its files; fields that a kind does not use are None."""

    project: Literal["cembench"] = "cembench"
    kind: Kind
    schema_version: Literal[1] = 1
    made_at: str | None = None
    #: Random part of the names of temporary files, so that no other process uses them.
    token: str | None = Field(default=None, pattern=r"^[0-9a-f]{32}$")
    #: SHA-256 of the files that we wrote, by path in the folder; while a file is being replaced,
    #: both the old and the new hash.
    files: dict[str, tuple[str, ...]] | None = None


def check(folder: Path, kind: Kind) -> Marker | None:
    """Return the marker of a folder, or None if it may get one; change nothing.

    Parameters
    ----------
    folder : Path
        A folder of this kind, an empty folder, or one that does not exist.
    kind : str
        The kind of folder that is needed.

    Raises
    ------
    RecordError
        The path is a file, or a folder that holds other files.
    """
    if folder.exists() and not folder.is_dir():
        raise RecordError(f"{folder} is a file; name a folder with -o.")
    try:
        names = sorted(path.name for path in folder.iterdir()) if folder.exists() else []
        if MARKERS[kind] in names:
            return _read(folder, kind)
        others = [name for name in names if not _is_passing(folder / name)]
        if not others:
            return None
    except OSError as error:
        raise RecordError(f"{folder} cannot be read: {error.strerror or error}.") from error
    held = ", ".join(others[:_NAMED]) + (", ..." if len(others) > _NAMED else "")
    raise RecordError(
        f"{folder} is not empty and not a {kind} of cembench: it holds {held}. Nothing was "
        f"changed. Name a new or empty folder with -o, or the folder of an earlier {kind}."
    )


def claim(folder: Path, kind: Kind) -> Marker:
    """Mark a folder as ours if :func:`check` allows it, and return the marker."""
    marker = check(folder, kind)
    if marker is not None:
        return marker
    now = datetime.now(UTC).isoformat(timespec="seconds")
    marker = Marker(kind=kind, made_at=now, token=uuid.uuid4().hex)
    _write(folder, marker)
    return marker


def publish(draft: Path, folder: Path, kind: Kind) -> None:
    """Move all files of a draft into a folder of ours; delete earlier files that it lacks.

    Files that we did not write, or that were changed since, are left alone.

    Raises
    ------
    RecordError
        The folder is not ours, or a foreign or changed file has the name of a draft's file (nothing
        is changed then), or the folder cannot be written to.
    """
    marker = check(folder, kind) or Marker(kind=kind)
    before = marker.files or {}
    files = sorted(path for path in draft.rglob("*") if path.is_file())
    made = {path.relative_to(draft).as_posix(): (sha256_of(path),) for path in files}
    in_the_way = [name for name in made if not _may_be_replaced(folder, name, before)]
    if in_the_way:
        held = ", ".join(in_the_way[:_NAMED]) + (", ..." if len(in_the_way) > _NAMED else "")
        raise RecordError(
            f"{folder} has files that cembench did not write, or that were changed since, in "
            f"place of those of the {kind}: {held}. Nothing was changed. Move them away, or name "
            "another "
            "folder with -o."
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        both = {name: (*made.get(name, ()), *before.get(name, ())) for name in {*made, *before}}
        _write(folder, marker.model_copy(update={"files": both}))
        for name in made:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (draft / name).replace(folder / name)
        for name in before:
            if name not in made and _is_unchanged(folder, name, before):
                (folder / name).unlink()
        _write(folder, marker.model_copy(update={"files": made}))
    except OSError as error:
        raise unwritable(folder, error) from error


def is_link_or_not_folder(path: Path) -> bool:
    """Whether a path exists and is a symbolic link or not a folder."""
    return path.is_symlink() or (path.exists() and not path.is_dir())


def _may_be_replaced(folder: Path, name: str, before: dict[str, tuple[str, ...]]) -> bool:
    """Whether a name in a folder is free, or holds a file as we wrote it."""
    above = [folder / parent for parent in PurePosixPath(name).parents if parent.name]
    if any(is_link_or_not_folder(parent) for parent in above):
        return False
    path = folder / name
    return not (path.is_symlink() or path.exists()) or _is_unchanged(folder, name, before)


def _is_unchanged(folder: Path, name: str, before: dict[str, tuple[str, ...]]) -> bool:
    """Whether a file is still as we wrote it; never for a name that leads out of the folder."""
    path = folder / name
    own = path.resolve() == folder.resolve() / name and ".." not in PurePosixPath(name).parts
    return own and path.is_file() and sha256_of(path) in before.get(name, ())


def _is_passing(path: Path) -> bool:
    """Whether a file is temporary: a draft, or the lock of a run that has just begun."""
    return is_draft(path) or (path.name == "lock" and is_empty_file(path))


def is_empty_file(path: Path) -> bool:
    """Whether a path is an empty regular file, as the lock of a run is."""
    return not path.is_symlink() and path.is_file() and path.stat().st_size == 0


def _read(folder: Path, kind: Kind) -> Marker:
    """Return the marker of a folder of this kind; :class:`RecordError` if there is none."""
    path = folder / MARKERS[kind]
    try:
        if path.is_symlink() or not path.is_file():
            raise RecordError(f"{path} is not a regular file.")
        marker = Marker.model_validate_json(path.read_bytes())
    except (RecordError, ValidationError):
        marker = None
    if marker is None or marker.kind != kind or (kind != "report" and marker.token is None):
        what = f"says that this is a {marker.kind}" if marker else "was not written by cembench"
        raise RecordError(
            f"{path} {what}, so {folder} is not accepted as a {kind}; an older cembench may have "
            "written it. Nothing was changed. Name a new folder with -o, or delete this one."
        )
    return marker


def _write(folder: Path, marker: Marker) -> None:
    text = marker.model_dump_json(indent=1, exclude_none=True) + "\n"
    write_text(folder / MARKERS[marker.kind], text)
