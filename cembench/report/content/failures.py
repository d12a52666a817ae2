"""Cells that did not end ok or were not finished."""

from __future__ import annotations

from cembench.report.content.evidence import Evidence
from cembench.report.declared import declared_table, own_tables
from cembench.report.document import Table, Text, words


def not_ok(evidence: Evidence) -> Table | Text:
    """Return a table of cells without a valid map, or a sentence if there is none."""
    declared = own_tables()["not-ok"]
    table = declared_table(evidence, "not-ok")
    held = {record.cell.key for record in evidence.store.records()}
    again = "requested but not finished: run the same `cembench run` again to resume"
    missing = tuple(
        tuple(map(words, (cell.mesh, cell.algorithm, cell.solves, "missing", again)))
        for cell in evidence.store.plan()
        if cell.key not in held
    )
    if table is None and not missing:
        return Text(f"All {len(evidence.records)} cells ended ok.")
    rows = table.rows if table else ()
    title = (
        f"{len(rows)} of {len(evidence.records)} cells did not end ok; {len(missing)} are missing"
    )
    columns = tuple(column.heading for column in declared.columns)
    return Table("not-ok", title, columns, (*rows, *missing), declared.caption)
