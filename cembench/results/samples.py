"""The journal of an unfinished cell, with one line per process.

A line is handed to the system when a process has ended, so it survives a kill. (It may not survive
a power cut: flushing the disk would cost more than all other book-keeping.) A line that a kill cut
short is ignored by readers and removed before the next is written. Journals are kept by
environment: rounds of two machines, or of two commits, are never mixed in one record.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from cembench.core.atomic import unwritable, write
from cembench.core.errors import RecordError
from cembench.core.loading import (
    check_no_link,
    damaged,
    is_there,
    open_file,
    read_arrays,
    read_bytes,
)
from cembench.results.records import Outcome, Round


class Entry(BaseModel):
    """A line of a journal: the outcome of the check, or a round with its number (from 0)."""

    check: Outcome | None = None
    number: int | None = None
    round: Round | None = None


@dataclass(frozen=True)
class Samples:
    """The journal of one cell in one environment, with its map as ``.npz`` beside it.

    `journal` is ``RUN/samples/CELL/ENVIRONMENT.jsonl``.
    """

    journal: Path

    def save_check(self, outcome: Outcome, uv: NDArray[np.complex128] | None) -> None:
        """Save the outcome of the checked call, after its map, so that the map is always there."""
        if uv is not None:
            check_no_link(self._map, self._run)
            write(self._map, lambda file: np.savez(file, uv=uv))
        self._append(Entry(check=outcome))

    def check(self) -> Outcome | None:
        """Return the outcome of the checked call; None if there was none yet."""
        return next((entry.check for entry in self._entries() if entry.check), None)

    def uv(self) -> NDArray[np.complex128] | None:
        """Return the map of the checked call, complex128 (n,)."""
        return read_map(self._map, self._run)

    def save_round(self, number: int, measured: Round) -> None:
        """Save one round; rounds are numbered from 0."""
        self._append(Entry(number=number, round=measured))

    def rounds(self) -> dict[int, Round]:
        """Return the saved rounds by number, in order."""
        by_number = {e.number: e.round for e in self._entries() if e.number is not None and e.round}
        return {number: by_number[number] for number in sorted(by_number)}

    @property
    def _run(self) -> Path:
        return self.journal.parents[2]

    @property
    def _map(self) -> Path:
        return self.journal.with_suffix(".npz")

    def _entries(self) -> list[Entry]:
        if not is_there(self.journal):
            return []
        lines = whole_lines(read_bytes(self.journal, self._run)).splitlines()
        try:
            return [Entry.model_validate_json(line) for line in lines]
        except ValidationError as error:
            raise RecordError(
                f"{self.journal} is damaged: {error.errors()[0]['msg']}. Delete it and run again."
            ) from error

    def _append(self, entry: Entry) -> None:
        append_line(self.journal, self._run, entry.model_dump_json(exclude_none=True))


def append_line(journal: Path, root: Path, line: str) -> None:
    """Append a line to a journal below `root`, in the place of one that a kill cut short."""
    try:
        journal.parent.mkdir(parents=True, exist_ok=True)
        handle = open_file(journal, root, os.O_RDWR | os.O_CREAT | os.O_APPEND)
        with os.fdopen(handle, "rb+") as file:
            file.truncate(len(whole_lines(file.read())))
            file.write(line.encode() + b"\n")
    except OSError as error:
        raise unwritable(journal, error) from error


def whole_lines(text: bytes) -> bytes:
    """Return a journal's bytes without a line that a kill cut short."""
    return text[: text.rfind(b"\n") + 1]


def read_map(path: Path, root: Path) -> NDArray[np.complex128] | None:
    """Return the map ``uv`` (n,) of an NPZ file of the run `root`; None if there is no file."""
    if not is_there(path):
        return None
    uv = read_arrays(path, ["uv"], root)["uv"]
    if uv.ndim != 1 or uv.dtype != np.complex128:
        raise damaged(path, "a map", f"its uv is {uv.dtype} {uv.shape}, not complex128 (n,)")
    return uv
