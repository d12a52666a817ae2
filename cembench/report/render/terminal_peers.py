"""Comparison with external libraries and programs, for a terminal of 80 columns."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from cembench.report.content.evidence import Evidence
from cembench.report.declared import declared_table
from cembench.report.document import Table
from cembench.report.render.grid import GridColumn, grid, names
from cembench.report.render.terminal import status_style
from cembench.results.external_words import marks_explained

#: Maximum characters of an algorithm's name; 80 columns have no room for more.
_ROOM = 25


def peers_tables(evidence: Evidence) -> RenderableType:
    """Return a table for each surface and target, sorted by E_C / A."""
    parts: list[RenderableType] = []
    frame = evidence.frame
    for (_, target), group in frame.groupby(["place", "target"]):
        first = evidence.by_key[group["key"].iloc[0]]
        about = {"surface": first.cell.mesh, "faces": f"{first.mesh.faces:,}", "target": target}
        table = declared_table(evidence, "peers", keys=group["key"], **about)
        parts += [Text(), on_terminal(table)] if table else []
    parts.append(
        Text(
            "\nE_C / A is E_C over the image's area; compare it within a target. call: seconds in "
            "the process. wall, start, solve: of an external program's process.",
            style="dim",
        )
    )
    parts += [Text(line, style="dim") for line in marks_explained(list(evidence.records))]
    causes = {
        f"{r.cell.mesh} / {r.cell.algorithm}: {r.outcome.cause}"
        for r in evidence.records
        if r.outcome.cause
    }
    return Group(*parts, *(Text(cause) for cause in sorted(causes)))


def on_terminal(table: Table) -> Grid:
    """Return a table of a report as a grid; what did not end ok is red."""
    columns = [
        GridColumn(column.title, figures=True, width=len(column.title))
        if column.numeric
        else names(column.title, _ROOM)
        for column in table.columns
    ]
    lines: list[list[str | Text]] = [
        [
            Text(value.text, style="" if column.title else status_style(value.text))
            for column, value in zip(table.columns, row, strict=True)
        ]
        for row in table.rows
    ]
    return grid(columns, lines, title=table.title)
