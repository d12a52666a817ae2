"""The records of a report, `records.csv`, read back as the rows that they were written from."""

from __future__ import annotations

import csv
import io
import json
import lzma
from pathlib import Path
from typing import Any

from cembench.core.errors import RecordError

#: The file of a report, and of one that a repository keeps.
RECORDS, PACKED = "records.csv", "records.csv.xz"
#: Columns of text, whatever it looks like.
_TEXT = frozenset({"mesh", "title", "cause", "source", "family", "mesh_hash", "environment", "key"})
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
            data = lzma.LZMADecompressor(memlimit=LARGEST).decompress(data, LARGEST)
        return list(csv.DictReader(io.StringIO(data.decode()), strict=True))
    except (OSError, lzma.LZMAError, UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{file} is not a table of records: {error}") from None


def read_rows(folder: Path) -> list[dict[str, Any]]:
    """Return the records of a report as :func:`cembench.results.columns.rows` gives them.

    Numbers have the digits that were written. Raises as :func:`text_rows`.
    """
    return [
        {name: text if name in _TEXT else _value(text) for name, text in row.items()}
        for row in text_rows(folder)
    ]


def _value(text: str | None) -> Any:
    """Return what an entry stands for: nothing, a number, a list, a dictionary or text."""
    if text in ("", None):
        return None
    if text in ("True", "False"):
        return text == "True"
    try:
        return json.loads(text)
    except ValueError:
        return text
