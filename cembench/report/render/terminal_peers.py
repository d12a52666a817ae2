"""Comparison with external libraries and programs, for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cembench.report.render.grid import GridColumn, grid, names
from cembench.report.render.terminal import status_style
from cembench.results.external_words import mark_of, marks_explained
from cembench.results.records import Record

#: Maximum characters of an algorithm's name; 80 columns have no room for more.
_ROOM = 25


def peers_table(records: Sequence[Record]) -> RenderableType:
    """Return one table per surface, grouped by target and sorted by E_C / A."""
    parts: list[RenderableType] = []
    ordered = sorted(records, key=_place)
    for name in dict.fromkeys(record.cell.mesh for record in records):
        chosen = [record for record in ordered if record.cell.mesh == name]
        parts.append(Text(f"\n{name}: {chosen[0].mesh.faces:,} triangles", style="bold"))
        parts.append(_of_surface(chosen))
    parts.append(
        Text(
            "\nE_C / A is E_C over the image's area; compare it within a target. call: seconds in "
            "the process. wall, start, solve: of an external program's process.",
            style="dim",
        )
    )
    parts += [Text(line, style="dim") for line in marks_explained(list(records))]
    causes = {
        f"{r.cell.mesh} / {r.cell.algorithm}: {r.outcome.cause}" for r in ordered if r.outcome.cause
    }
    return Group(*parts, *(Text(cause) for cause in sorted(causes)))


def _of_surface(records: Sequence[Record]) -> Table:
    headings = ("E_C / A", "angle°", "isl.", "call", "wall", "start", "solve")
    rows: list[list[str | Text]] = []
    for target, group in groupby(records, key=lambda record: record.target):
        rows.append([Text(f"to {target}", style="dim"), *("" for _ in headings), ""])
        for record in group:
            outcome, program = record.outcome, record.is_program
            wall, metrics = outcome.median_seconds, outcome.metrics
            solve = outcome.solve_seconds if program else None
            rows.append(
                [
                    f"{record.cell.algorithm} {mark_of(record)}".rstrip(),
                    _number(record.outcome.relative_energy, ".4f"),
                    _number(metrics.get("angle_error_mean_deg"), ".2f"),
                    _number(metrics.get("islands"), ".0f"),
                    _number(None if program else wall, ".3f"),
                    _number(wall if program else None, ".2f"),
                    _number(outcome.start_seconds, ".2f"),
                    _number(solve, ".3f"),
                    Text(_end(record), style=status_style(outcome.status)),
                ]
            )
    columns = [GridColumn(heading, figures=True, width=len(heading)) for heading in headings]
    return grid([names("algorithm", _ROOM), *columns, names("")], rows)


def _end(record: Record) -> str:
    """Return the status, or the number of folds."""
    folds = record.outcome.metrics.get("flipped_triangles")
    return f"{folds:,} folds" if folds else record.outcome.status


def _place(record: Record) -> tuple[str, bool, float]:
    energy = record.outcome.relative_energy
    return record.target, energy is None, energy or 0.0


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
