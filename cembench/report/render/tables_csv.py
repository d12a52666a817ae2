"""Render a report's tables as CSV: numbers with full precision, origins and remarks."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from cembench.core.atomic import write_text
from cembench.report.document import Report, Table, csv_of, heading, tables_of


def write_tables_csv(report: Report, folder: Path) -> list[Path]:
    """Write every table; return the paths of the files."""
    paths = []
    for table in tables_of(report):
        path = folder / csv_of(table)
        write_text(path, table_csv(table))
        paths.append(path)
    return paths


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
