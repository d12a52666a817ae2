"""Files that are whole or not there, whenever the process that writes them is killed."""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, TypeVar

from pydantic import BaseModel, ValidationError

from cembench.core.errors import RecordError

M = TypeVar("M", bound=BaseModel)

#: How the names of files begin that are not finished.
DRAFT = ".draft-"


def read_model(path: Path, model: type[M]) -> M:
    """Read what :func:`write_model` wrote; :class:`RecordError` says which file is damaged."""
    try:
        return model.model_validate_json(path.read_bytes())
    except ValidationError as error:
        raise RecordError(
            f"{path} is not a {model.__name__.lower()}: {error.errors()[0]['msg']}. "
            "Delete it and run again."
        ) from error


def write_model(path: Path, model: BaseModel) -> None:
    """Write a model as JSON."""
    text = model.model_dump_json(indent=2)
    write(path, lambda file: file.write(text.encode()))


def write(path: Path, fill: Callable[[BinaryIO], object]) -> None:
    """Let `fill` write a draft, flush it to disk, and only then give it its name.

    Who may read it is up to the user's umask, as for any file.

    Raises
    ------
    RecordError
        The disk is full, or the place cannot be written to.

    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.parent / f"{DRAFT}{uuid.uuid4().hex}"
        try:
            with draft.open("xb") as file:
                fill(file)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, error: OSError) -> RecordError:
    """What to say of a file that could not be written."""
    return RecordError(
        f"{path} cannot be written: {error.strerror or error}. Choose another folder with -o."
    )


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
