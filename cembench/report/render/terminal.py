"""Lay out what a report is made of on a terminal, and the head of a report with its first tables.

Where a table is too wide, its headings are broken into lines; then columns that are details are
left out, long texts are broken into lines, and at last names are shortened.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, product
from textwrap import wrap

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.padding import Padding
from rich.table import Table as Grid
from rich.text import Text as Line

from cembench.report.document import (
    ORIGINS,
    Column,
    Gap,
    OnTerminal,
    Report,
    Section,
    Table,
    Text,
    Tone,
    Value,
    is_prose,
    items_of,
    marked,
    of_status,
    plain,
    words,
)

STYLES: Mapping[Tone, str] = {
    "": "",
    "good": "green",
    "doubtful": "yellow",
    "bad": "bold red",
    "faint": "dim",
}
#: Minimum width of a name, and of a text that is broken into lines.
NAME, PROSE = 8, 20
#: Whether headings are broken into lines, and the gap: what is tried one after the other.
_WAYS = ((False, 2), (False, 1), (True, 1))


def status_style(status: str) -> str:
    """Return the colour of a status."""
    return STYLES[of_status(status).tone]


def on_terminal(item: OnTerminal) -> RenderableType:
    """Return a table or a section for a terminal; pictures are left out."""
    return Group(*_parts(item))


def _parts(item: object) -> Iterator[RenderableType]:
    if isinstance(item, Table):
        yield _Layout(item)
    elif isinstance(item, Text):
        yield Line(item.words)
    elif isinstance(item, Gap):
        yield Line(f"{item.title}: {item.why}", STYLES["doubtful"])
    elif isinstance(item, Section):
        if item.title:
            yield Line(item.title, "bold")
        for number, part in enumerate((*item.items, *item.sections)):
            if number and not isinstance(part, Text) and part.title:
                yield Line()
            for shown in _parts(part):
                indented = bool(item.title) and isinstance(part, Text)
                yield Padding(shown, (0, 0, 0, 2), expand=False) if indented else shown


@dataclass(frozen=True)
class _Layout:
    """A table that is laid out when the width of the terminal is known."""

    table: Table

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        table, widths, gap = _fitted(_with_origins(self.table), options.max_width)
        if table.title:
            yield Line(table.title, "bold")
        if table.rows:
            yield from (Line(line, "bold") for line in _groups(table.columns, widths, gap))
            yield _grid(table, widths, gap)
        for tone, below in _below(table):
            yield Line(below, STYLES[tone])


def _with_origins(table: Table) -> Table:
    """Return a table whose rows, or else its numbers, have marks where origins differ."""
    numbers = [{v.origin for v in row if v.number is not None} for row in table.rows]
    held = set().union(*numbers) - {"", "derived"}
    if len(held) < 2:
        return table
    legend = [f"{mark} {name}" for o, (name, mark) in ORIGINS.items() if o in held and mark]
    by_row = all(len(own - {"", "derived"}) < 2 for own in numbers)
    rows = tuple(
        (replace(row[0], text=row[0].text + "".join(ORIGINS[o][1] for o in own & held)), *row[1:])
        if by_row
        else tuple(replace(v, text=marked(v, c)) for v, c in zip(row, table.columns, strict=True))
        for row, own in zip(table.rows, numbers, strict=True)
    )
    return replace(table, rows=rows, notes=(*table.notes, "; ".join(legend)))


def _fitted(table: Table, width: int) -> tuple[Table, list[int], int]:
    """Return a table, perhaps without details, with the widths of its columns and their gap."""
    short = [k for k, column in enumerate(table.columns) if not column.detail]
    for shown, (broken, gap) in product((range(len(table.columns)), short), _WAYS):
        chosen = table.only(shown)
        widths = _widths(chosen, gap, broken=broken)
        excess = sum(widths) + gap * (len(widths) - 1) - width
        if excess <= 0:
            return chosen, widths, gap
    texts = [k for k, column in enumerate(chosen.columns) if not column.numeric]
    for least, prose in ((PROSE, True), (NAME, False)):
        some = [k for k in texts if is_prose(chosen, k) == prose]
        while excess > 0 and some and widths[k := max(some, key=widths.__getitem__)] > least:
            widths[k], excess = widths[k] - 1, excess - 1
    return chosen, widths, gap


def _widths(table: Table, gap: int, *, broken: bool) -> list[int]:
    """Return the widths that the entries, the headings and the groups above them need."""
    widths = []
    for k, head in enumerate(map(_title, table.columns)):
        parts = head.split() if broken else [head]
        widths.append(max([*map(len, parts), *(cell_len(row[k].text) for row in table.rows), 0]))
    place = 0
    for group, run in groupby(column.group for column in table.columns):
        after = place + len(list(run))
        need = max(map(len, group.split()), default=0) if broken else len(group)
        span = sum(widths[place:after]) + gap * (after - place - 1)
        widths[after - 1] += max(0, need - span)
        place = after
    return widths


def _title(column: Column) -> str:
    """Return a heading; times are in seconds, which needs no unit."""
    return f"{column.title} [{column.unit}]" if column.unit not in ("", "s") else column.title


def _groups(columns: Sequence[Column], widths: Sequence[int], gap: int) -> list[str]:
    """Return the lines above the headings, each group over its columns."""
    blocks = []
    for group, run in groupby(zip(columns, widths, strict=True), lambda one: one[0].group):
        own = [width for _, width in run]
        span = sum(own) + gap * (len(own) - 1)
        lines = wrap(group, span) or [""]
        blocks.append([f"{line:>{span}}" if len(own) == 1 else f"{line:^{span}}" for line in lines])
    height = max(map(len, blocks)) if any(column.group for column in columns) else 0
    full = [[" " * len(block[0])] * (height - len(block)) + block for block in blocks]
    return [(" " * gap).join(line).rstrip() for line in zip(*full, strict=True)] if height else []


def _grid(table: Table, widths: Sequence[int], gap: int) -> Grid:
    headed = any(column.title for column in table.columns)
    grid = Grid(
        box=None, pad_edge=False, padding=(0, gap, 0, 0), header_style="bold", show_header=headed
    )
    has_prose = any(is_prose(table, k) for k in range(len(widths)))
    for k, (column, width) in enumerate(zip(table.columns, widths, strict=True)):
        cut = not (column.numeric or has_prose)
        grid.add_column(
            _title(column), width=width, no_wrap=cut, overflow="ellipsis" if cut else "fold",
            justify="right" if column.numeric else "left",
            style="" if headed or k else "bold", vertical="top",
        )  # fmt: skip
    above = ""
    for row in table.rows:
        lines = [Line(value.text, STYLES[value.tone]) for value in row]
        if headed and not table.columns[0].numeric and row[0].text == above:
            lines[0] = Line()
        above = row[0].text
        grid.add_row(*lines)
    return grid


def _below(table: Table) -> Iterator[tuple[Tone, str]]:
    """Yield what is said below a table, with the reasons that no note has."""
    notes = [table.caption, *table.notes]
    yield from (("faint", note) for note in notes if note)
    reasons = {v.why: v for row in table.rows for v in row if v.why}
    for why, value in reasons.items():
        if not any(why in note for note in notes):
            gap = value.number is None
            yield ("faint", f"{value.text}: {why}") if gap else ("doubtful", why)


def folded(table: Table) -> Table:
    """Return a table with the columns of each group below each other, in lines of their own."""
    grouped = {(c.group, c.title): k for k, c in enumerate(table.columns) if c.group}
    groups, titles = (list(dict.fromkeys(names)) for names in zip(*grouped, strict=True))

    def shown(row: Sequence[Value], title: str, group: str) -> Value:
        k = grouped.get((group, title))
        if k is None:
            return words("")
        tone: Tone = "faint" if row[k].origin == "printed" else row[k].tone
        return replace(row[k], text=marked(row[k], table.columns[k]), origin="", tone=tone)

    rows = [
        (row[0], words(title), *(shown(row, title, group) for group in groups))
        for row in table.rows
        for title in titles
    ]
    columns = (table.columns[0], Column("", numeric=False), *map(Column, groups))
    return replace(table, columns=columns, rows=tuple(rows))


def paper_tables(report: Report) -> RenderableType:
    """Return the head and the paper's tables, printed figures above measured ones.

    A run over the user's own surfaces has its own table instead.
    """
    tables = {table.name: table for table in items_of(report, Table)}
    printed = [f"table-{number}" for number in (report.paper.printed if report.paper else ())]
    names = (name if name in tables else f"{name}-other-surfaces" for name in printed)
    chosen = [tables[name] for name in names if name in tables]
    parts = list(_head(report))
    for table in chosen:
        notes = tuple(note for note in table.notes if note != table.absent)
        parts += [folded(replace(table, caption="", notes=notes)), ""]
    absent = {table.absent for table in chosen if table.absent}
    parts += [Line(note, STYLES["faint"]) for note in sorted(absent)]
    if chosen:
        marks = [f"{mark} {words}" for words, mark in ORIGINS.values() if mark and mark != "ᵖ"]
        parts.append(Line(f"{'; '.join(marks)}; † misprint; ! unstable", STYLES["faint"]))
    return Group(*parts)


def _head(report: Report) -> Iterator[RenderableType]:
    """Yield the title, the paper that the report is about, and the findings."""
    yield Line(report.title, "bold")
    if report.paper is not None:
        yield Line(f"{report.paper.authors}. {report.paper.place}. doi:{report.paper.doi}")
    findings = report.findings
    if findings is not None:
        tables: list[RenderableType] = [
            folded(bare) if all(c.group for c in bare.columns[2:]) else bare
            for bare in (replace(table, caption="", notes=()) for table in findings.tables)
        ]
        lines = [Line(f"\n{plain(sentence)}") for sentence in findings.sentences]
        yield from (*lines[:1], Line(), *tables[:1], *lines[1:], Line())
        yield from (part for table in tables[1:] for part in (table, Line()))
        yield from (Line(f"! {line}", STYLES["doubtful"]) for line in findings.suspects)
        for figure in findings.figures:
            line = Line.assemble((figure.number, "bold"), f"  {figure.words}")
            yield Padding(line, (0, 0, 0, 2), expand=False)
    yield Line()
