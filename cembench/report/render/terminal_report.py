"""The head of a report and its first tables on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from cembench.report.document import ORIGINS, Report, plain, tables_of
from cembench.report.render.terminal import STYLES, folded

#: Tables that `report` and `reproduce` show, and those shown if these are missing.
SHOWN = ("table-1", "table-2", "table-3", "table-4")


def paper_tables(report: Report) -> RenderableType:
    """Return the head and the paper's four tables, printed figures above measured ones.

    A run over the user's own surfaces has its own table instead.
    """
    tables = {table.name: table for table in tables_of(report)}
    names = (name if name in tables else f"{name}-other-surfaces" for name in SHOWN)
    chosen = [tables[name] for name in names if name in tables]
    parts = list(_head(report))
    for table in chosen:
        notes = tuple(note for note in table.notes if note != table.absent)
        parts += [folded(replace(table, caption="", notes=notes)), ""]
    absent = {table.absent for table in chosen if table.absent}
    parts += [Text(note, STYLES["faint"]) for note in sorted(absent)]
    if chosen:
        marks = [f"{mark} {words}" for words, mark in ORIGINS.values() if mark and mark != "ᵖ"]
        parts.append(Text(f"{'; '.join(marks)}; † misprint; ! unstable", STYLES["faint"]))
    return Group(*parts)


def _head(report: Report) -> Iterator[RenderableType]:
    """Yield the title, the paper that the report is about, and the findings."""
    yield Text(report.title, "bold")
    if report.paper is not None:
        yield Text(f"{report.paper.authors}. {report.paper.place}. doi:{report.paper.doi}")
    found = report.findings
    if found is not None:
        yield from (Text(f"\n{plain(sentence)}") for sentence in found.sentences)
        yield Text()
        yield from (Text(f"! {line}", STYLES["doubtful"]) for line in found.suspects)
        if found.table is not None:
            yield from (folded(replace(found.table, caption="", notes=())), Text())
        for figure in found.figures:
            line = Text.assemble((figure.number, "bold"), f"  {figure.words}")
            yield Padding(line, (0, 0, 0, 2), expand=False)
    yield Text()
