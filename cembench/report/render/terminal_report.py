"""A report's tables for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from cembench.report.document import (
    ORIGINS,
    Column,
    Report,
    Table,
    Value,
    marked,
    plain,
    tables_of,
)
from cembench.report.render.grid import GridColumn, grid, names

#: Tables that `report` and `reproduce` show, and those shown if these are missing.
SHOWN = ("table-1", "table-2", "table-3", "table-4")
_BESIDE = ("printed", "here")
#: Width of a line, and minimum width of a surface's name, in characters.
WIDTH, NAME = 80, 12


def paper_tables(report: Report) -> RenderableType:
    """Return the head and the paper's four tables, printed figures above measured ones.

    A run over the user's own surfaces has its own table instead.
    """
    tables = {table.name: table for table in tables_of(report)}
    chosen = [
        tables[name]
        for name in (n if n in tables else f"{n}-other-surfaces" for n in SHOWN)
        if name in tables
    ]
    parts = _head(report)
    for table in chosen:
        parts += [Text(table.title, style="bold"), _folded(table)]
        notes = [note for note in table.notes if note != table.absent]
        parts += [Padding(Text(note, style="dim"), (0, 0, 0, 2)) for note in notes]
        parts.append(Text(""))
    absent = {table.absent for table in chosen if table.absent}
    parts += [Text(note, style="dim") for note in sorted(absent)]
    if not chosen:
        return Group(*parts)
    marks = [f"{mark} {words}" for words, mark in ORIGINS.values() if mark and mark != "ᵖ"]
    return Group(*parts, Text(f"{'; '.join(marks)}; † misprint; ! unstable", style="dim"))


def _head(report: Report) -> list[RenderableType]:
    """Return the title, the paper that the report is about, and the findings."""
    parts: list[RenderableType] = [Text(report.title, style="bold")]
    if report.paper is not None:
        parts.append(Text(f"{report.paper.authors}. {report.paper.place}. doi:{report.paper.doi}"))
    found = report.findings
    if found is not None:
        parts += [Text(f"\n{plain(sentence)}") for sentence in found.sentences]
        parts.append(Text(""))
        parts += [Text(f"! {line}", style="yellow") for line in found.suspects]
        if found.table is not None:
            parts += [_by_surface(found.table), Text("")]
        for figure in found.figures:
            line = Text.assemble((figure.number, "bold"), f"  {figure.words}")
            parts.append(Padding(line, (0, 0, 0, 2)))
    return [*parts, Text("")]


def _by_surface(table: Table) -> RenderableType:
    """Return a table of surfaces by groups of algorithms with a row for each of both."""
    grouped = [(k, column) for k, column in enumerate(table.columns) if column.group]
    groups = list(dict.fromkeys(column.group for _, column in grouped))
    algorithms = list(dict.fromkeys(column.title for _, column in grouped))
    places = {(column.title, column.group): k for k, column in grouped}
    lines: list[list[str | Text]] = [
        [
            row[0].text if k == 0 else "",
            algorithm,
            *(_entry(row[places[algorithm, group]]) for group in groups),
        ]
        for row in table.rows
        for k, algorithm in enumerate(algorithms)
    ]
    heads = [GridColumn(group, figures=True, wraps=True) for group in groups]
    return grid([names("surface", 24), names("algorithm", 24), *heads], lines, title=table.title)


def _folded(table: Table) -> RenderableType:
    """Return a table with "printed" and "here" in rows below each other, not side by side."""
    places = [k for k, column in enumerate(table.columns) if column.numeric and column.group]
    groups = list(dict.fromkeys(table.columns[k].group for k in places))
    kinds = [k for k in _BESIDE if any(table.columns[p].title == k for p in places)]
    wide = [_width(table, group) for group in groups]
    room = max(NAME, WIDTH - len("paper") - 2 - sum(wide) - len(wide))
    heads = [
        GridColumn(group, figures=True, wraps=True, width=width)
        for group, width in zip(groups, wide, strict=True)
    ]
    body = len(table.rows) - table.footer_rows
    lines: list[list[str | Text]] = []
    styles = []
    for number, row in enumerate(table.rows):
        for k, kind in enumerate(kinds):
            cells = [_cell(table.columns, row, group, kind) for group in groups]
            name = row[0].text if k == 0 or number >= body else ""
            short = "paper" if kind == "printed" else kind
            lines.append([name, short, *cells])
            styles.append("dim" if kind == "printed" else "")
    return grid([names("surface", room), names(""), *heads], lines, styles=styles)


def _width(table: Table, group: str) -> int:
    """Return the width of the longest entry of a group, or of the longest word above it."""
    entries = [
        marked(row[k], column)
        for k, column in enumerate(table.columns)
        if column.group == group
        for row in table.rows
    ]
    return max(map(len, [*entries, *group.split()]), default=0)


def _cell(columns: Sequence[Column], row: Sequence[Value], group: str, kind: str) -> Text:
    for column, value in zip(columns, row, strict=True):
        if column.group == group and column.title == kind:
            return _entry(value, marked(value, column))
    return Text("")


def _entry(value: Value, text: str = "") -> Text:
    lacking = value.number is None and value.record
    return Text(text or value.text, style="bold red" if lacking else "")
