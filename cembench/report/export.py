"""Export a run as one table: CSV, Parquet or JSON; and the tables of a report as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from cembench.core.atomic import write, write_text
from cembench.core.extras import Extra, require
from cembench.report.document import Report, Table, csv_of, heading, items_of

Rows = Sequence[dict[str, Any]]


def export_rows(rows: Rows, path: Path, form: Literal["csv", "parquet", "json"]) -> None:
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
    exporters = {"csv": _csv, "parquet": _parquet, "json": _json}
    if form == "parquet":
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


def write_tables_csv(report: Report, folder: Path) -> None:
    """Write every table of a report."""
    for table in items_of(report, Table):
        write_text(folder / csv_of(table), table_csv(table))


def table_csv(table: Table) -> str:
    """Return a table as CSV, with numbers in full precision.

    A numeric column is followed by one with the origins of its numbers and one with remarks; a gap
    is empty, and its cause is in the remarks.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    headings: list[str] = []
    for column in table.columns:
        name = heading(column)
        headings += [name, f"{name}: origin", f"{name}: note"] if column.numeric else [name]
    writer.writerow(headings)
    for row in table.rows:
        cells: list[str | float | None] = []
        for column, value in zip(table.columns, row, strict=True):
            if column.numeric:
                status = value.text if value.number is None and value.record else ""
                cells += [value.number, value.origin or status, value.why]
            else:
                cells.append(value.text)
        writer.writerow(cells)
    return text.getvalue()
