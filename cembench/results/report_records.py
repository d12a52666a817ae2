"""The records of a report, `records.csv`, read back as the rows that they were written from."""

from __future__ import annotations

import csv
import io
import lzma
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Json, PositiveFloat, ValidationError

from cembench.core.errors import RecordError

#: The file of a report, and of one that a repository keeps.
RECORDS, PACKED = "records.csv", "records.csv.xz"
#: Largest number of bytes that packed records may unpack to.
LARGEST = 2**30


def has_records(folder: Path) -> bool:
    """Whether a folder has the records of a report."""
    return any((folder / name).is_file() for name in (PACKED, RECORDS))


def text_rows(folder: Path) -> list[dict[str, str]]:
    """Return the records of a report, packed or not, as rows of text.

    Raises
    ------
    RecordError
        The file cannot be read as such a table, or is too large.
    """
    file = next((folder / name for name in (PACKED, RECORDS) if (folder / name).is_file()), None)
    if file is None:
        raise RecordError(f"{folder} has neither {RECORDS} nor {PACKED}.")
    csv.field_size_limit(2**31 - 1)
    try:
        data = file.read_bytes()
        if file.name == PACKED:
            unpack = lzma.LZMADecompressor(memlimit=LARGEST)
            data = unpack.decompress(data, LARGEST)
            if not unpack.eof:
                raise lzma.LZMAError(f"it is cut short, or unpacks to over {LARGEST:,} bytes")
        return list(csv.DictReader(io.StringIO(data.decode()), strict=True))
    except (OSError, lzma.LZMAError, UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{file} is not a table of records: {error}") from None


class _Cell(BaseModel):
    """What a row says of a cell, its times and its map."""

    mesh: str
    algorithm: str
    parameters: Json[dict[str, Any]]
    solves: str
    backend: str
    threads: int
    mesh_hash: str
    precision: float | None = None
    environment: str
    seconds: PositiveFloat | None = None
    seconds_raw: Json[list[PositiveFloat]]
    seconds_kernel: Json[list[PositiveFloat | None]] = []
    reference: str | None = None
    verdict: str | None = None
    status: str = "ok"
    cause: str | None = None
    target: str = "disk"
    conformal_energy: float | None = None
    common_gauge_energy: float | None = None
    image_area: float | None = None
    angle_error_mean_deg: float | None = None
    flipped_triangles: int | None = None


def read_rows(folder: Path) -> list[dict[str, Any]]:
    """Return the timed cells of a report: some columns of :func:`cembench.results.columns.rows`.

    Numbers have the digits that were written. Raises as :func:`text_rows`, and where a record does
    not say which cell it is of.
    """
    rows = []
    for number, row in enumerate(text_rows(folder), start=1):
        filled = {name: text for name, text in row.items() if name and text}
        try:
            rows.append(_Cell.model_validate(filled).model_dump())
        except ValidationError as error:
            first = error.errors()[0]
            raise RecordError(
                f"record {number} in {folder}: {first['loc'][0]}: {first['msg']}. Make the report "
                "again, or name the folder of its run."
            ) from None
    return rows
