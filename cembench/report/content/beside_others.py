"""Comparison of cembench's algorithms with external libraries and programs, by surface.

Maps with the same target are listed together, sorted by E_C / A; targets are never ranked against
each other. The seconds of an external program have separate columns.
"""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.content.printed_beside_measured import significant
from cembench.report.document import Column, Table, Value, words
from cembench.results.external_words import mark_of, marks_explained, solve_words
from cembench.results.records import Record


def beside_others(evidence: Evidence) -> Table | None:
    """Return a table with a row per surface and algorithm; None without external algorithms."""
    if not any(record.external for record in evidence.records):
        return None
    policy = evidence.policies[0]
    rows, shown, notes = [], list[Record](), dict[str, None]()
    for surface in evidence.surfaces:
        found = [
            (series, record)
            for series in evidence.series
            if (record := evidence.find(surface, series, policy)) is not None
        ]
        for series, record in sorted(found, key=_place):
            rows.append(_row(evidence, surface, series, record))
            shown.append(record)
            if record.outcome.status != "ok":
                notes[f"{surface.title}, {series.label}: {evidence.missing_reason(record)}"] = None
    return Table(
        "beside-others",
        "Beside libraries and programs of others",
        (
            Column("surface", numeric=False),
            Column("target", numeric=False),
            Column("algorithm", numeric=False),
            Column("status", numeric=False),
            Column("E_C / A"),
            Column("angle°"),
            Column("folds"),
            Column("islands"),
            Column("call", "seconds"),
            Column("wall", "seconds"),
            Column("start", "seconds"),
            Column("solve", "seconds"),
            Column("solve from", numeric=False),
        ),
        tuple(rows),
        "E_C is divided by the area of the image, because only disks have a fixed size; compare it "
        "within a target. Seconds are those of a call in the process; for an external program, the "
        "wall clock of its process, that on a small mesh, and the solve time.",
        (*marks_explained(shown), *notes),
    )


def _place(found: tuple[AlgorithmSeries, Record]) -> tuple[str, bool, float]:
    series, record = found
    energy = record.outcome.relative_energy
    return series.target, energy is None, energy or 0.0


def _row(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, record: Record
) -> tuple[Value, ...]:
    outcome, key = record.outcome, record.cell.key
    why = evidence.missing_reason(record) if outcome.status != "ok" else ""

    def value(number: float | None, text: str) -> Value:
        if number is None:
            return Value("-", None, "", key, why or "none")
        return Value(text, float(number), surface.origin, key)

    def seconds(number: float | None) -> Value:
        return value(number, significant(number or 0.0))

    metrics = outcome.metrics
    energy = record.outcome.relative_energy
    mean, folds = metrics.get("angle_error_mean_deg"), metrics.get("flipped_triangles")
    islands, program = metrics.get("islands"), record.is_program
    wall = outcome.median_seconds
    return (
        words(surface.title),
        words(series.target),
        words(f"{series.label} {mark_of(record)}".rstrip()),
        Value(outcome.status, None, "", key, why),
        value(energy, f"{energy or 0.0:.4f}"),
        value(mean, f"{mean or 0.0:.2f}"),
        value(folds, f"{folds or 0:.0f}"),
        value(islands, f"{islands or 0:.0f}"),
        seconds(None if program else wall),
        seconds(wall if program else None),
        seconds(outcome.start_seconds),
        seconds(outcome.solve_seconds if program else None),
        words(solve_words(record) if program and outcome.solve_seconds else "-"),
    )
