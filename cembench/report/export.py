"""A run as one file, for whatever reads tables: CSV, Parquet or JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any

from cembench.core.atomic import write
from cembench.core.extras import Extra, require


class Format(StrEnum):
    """What a run can be exported as."""

    csv = "csv"
    parquet = "parquet"
    json = "json"


Rows = Sequence[dict[str, Any]]


def export_rows(rows: Rows, path: Path, form: Format) -> None:
    """Write rows of :func:`cembench.results.record_rows.rows` to a file, whole or not at all.

    In CSV lists and dictionaries are JSON in a cell. In Parquet lists are lists, and dictionaries,
    whose keys differ from row to row, are JSON.

    Raises
    ------
    MissingExtra
        Parquet without pyarrow.
    RecordError
        The place cannot be written to.

    """
    exporters: dict[Format, Callable[[Rows, Any], None]] = {
        Format.csv: _csv,
        Format.parquet: _parquet,
        Format.json: _json,
    }
    if form is Format.parquet:
        require(Extra.PARQUET, "a Parquet file")
    write(path, lambda file: exporters[form](rows, file))


def _columns(rows: Rows) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def _json(rows: Rows, file: Any) -> None:
    file.write((json.dumps(list(rows), indent=2) + "\n").encode())


def _csv(rows: Rows, file: Any) -> None:
    def flat(value: Any) -> Any:
        return json.dumps(value) if isinstance(value, list | dict) else value

    class _Text:
        def write(self, text: str) -> None:
            file.write(text.encode())

    writer = csv.DictWriter(_Text(), _columns(rows), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: flat(value) for name, value in row.items()} for row in rows)


def _parquet(rows: Rows, file: Any) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    def flat(value: Any) -> Any:
        return json.dumps(value) if isinstance(value, dict) else value

    table = {name: [flat(row.get(name)) for row in rows] for name in _columns(rows)}
    parquet.write_table(pa.table(table), file)
