"""A run on disk: one JSON record a cell, its map beside it, and the machine it was measured on.

::

    RUN/records/<mesh>--<algorithm>--<key>.json
    RUN/maps/<mesh>--<algorithm>--<key>.npz       uv, complex128 (n,)
    RUN/environments/<id>.json

Every file is written to a draft, flushed to disk and renamed: it is whole or not there.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from cembench.errors import RecordError
from cembench.records import SCHEMA_VERSION, Cell, Record


class Store:
    """The records under one folder, which is made when the first is saved."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find(self, cell: Cell) -> Record | None:
        """What was recorded of this cell, if anything?"""
        path = self._record_path(cell)
        return _read(path) if path.exists() else None

    def records(self) -> list[Record]:
        """All records, by name of their files.

        Raises
        ------
        RecordError
            The folder holds no run, or a record is damaged or of another schema.

        """
        if not (self.folder / "records").is_dir():
            raise RecordError(
                f"{self.folder} holds no run: there is no folder {self.folder / 'records'}. "
                "Make one with `cembench run`."
            )
        return [_read(path) for path in sorted((self.folder / "records").glob("*.json"))]

    def save(
        self, record: Record, uv: NDArray[np.complex128] | None, environment: dict[str, Any]
    ) -> None:
        """Write the environment, the map and last the record, so that a record finds its map."""
        about = self.folder / "environments" / f"{record.environment}.json"
        if not about.exists():
            _write(about, lambda file: file.write(json.dumps(environment, indent=2).encode()))
        if uv is not None:
            _write(self._map_path(record.cell), lambda file: np.savez_compressed(file, uv=uv))
        text = record.model_dump_json(indent=2)
        _write(self._record_path(record.cell), lambda file: file.write(text.encode()))

    def uv(self, cell: Cell) -> NDArray[np.complex128] | None:
        """The recorded map (n,), or None where there is none."""
        path = self._map_path(cell)
        if not path.exists():
            return None
        with np.load(path) as archive:
            return np.asarray(archive["uv"])

    def _record_path(self, cell: Cell) -> Path:
        return self.folder / "records" / f"{cell.label}.json"

    def _map_path(self, cell: Cell) -> Path:
        return self.folder / "maps" / f"{cell.label}.npz"


def _read(path: Path) -> Record:
    try:
        record = Record.model_validate_json(path.read_bytes())
    except ValidationError as error:
        raise RecordError(
            f"{path} is not a record: {error.errors()[0]['msg']}. Delete it and run again."
        ) from error
    if record.schema_version != SCHEMA_VERSION:
        raise RecordError(
            f"{path} is of schema version {record.schema_version}; this cembench reads "
            f"{SCHEMA_VERSION}. Run again into another folder."
        )
    return record


def _write(path: Path, fill: Callable[[BinaryIO], object]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, draft = tempfile.mkstemp(dir=path.parent, prefix=".draft-")
        try:
            with os.fdopen(handle, "wb") as file:
                fill(file)
                file.flush()
                os.fsync(file.fileno())
            Path(draft).replace(path)
        finally:
            Path(draft).unlink(missing_ok=True)
    except OSError as error:
        raise RecordError(
            f"{path} cannot be written: {error.strerror or error}. Choose another folder with -o."
        ) from error
