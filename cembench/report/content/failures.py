"""Cells that did not end ok or were not finished."""

from __future__ import annotations

from cembench.report.content.evidence import Evidence
from cembench.report.document import Column, Table, Text, Value, words


def not_ok(evidence: Evidence) -> Table | Text:
    """Return a table of cells without a valid map, or a sentence if there is none."""
    rows = []
    for record in evidence.records:
        outcome, cell = record.outcome, record.cell
        if outcome.status != "ok":
            rows.append(
                (
                    words(cell.mesh),
                    words(record.title),
                    words(cell.solves),
                    Value(outcome.status, None, "", cell.key),
                    words(outcome.cause or ""),
                )
            )
    held = {record.cell.key for record in evidence.store.records()}
    absent = [cell for cell in evidence.store.plan() if cell.key not in held]
    missing = [
        (
            words(cell.mesh),
            words(cell.algorithm),
            words(cell.solves),
            words("missing"),
            words("requested but not finished: run the same `cembench run` again to resume"),
        )
        for cell in absent
    ]
    if not rows and not missing:
        return Text(f"All {len(evidence.records)} cells ended ok.")
    headings = ("surface", "algorithm", "solves", "status", "cause")
    return Table(
        "not-ok",
        f"{len(rows)} of {len(evidence.records)} cells did not end ok; {len(missing)} are missing",
        tuple(Column(heading, numeric=False) for heading in headings),
        (*rows, *missing),
        "Such cells are gaps in the tables, count as infinitely slow in performance profiles, and "
        "are left out of averages, which state their n.",
    )
