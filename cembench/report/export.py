"""Export a run as one table: CSV, Parquet or JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cembench.core.atomic import write
from cembench.core.extras import Extra, require
from cembench.report.export_format import Format

Rows = Sequence[dict[str, Any]]


def export_rows(rows: Rows, path: Path, form: Format) -> None:
    """Write the rows of :func:`cembench.results.columns.rows` to a file.

    In CSV, lists and dictionaries are written as JSON. In Parquet, lists stay lists; dictionaries,
    whose keys differ from row to row, are written as JSON. No partial file is left.

    Raises
    ------
    MissingExtra
        Parquet is requested, but pyarrow is not installed.
    RecordError
        The file cannot be written.

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
