"""Printed and measured figures side by side, the common form of a paper's tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.declared import figure_entry
from cembench.report.document import Column, Table, Value, count, entry, missing, words
from cembench.results.columns import FrameColumn
from cembench.results.multiple_testing import geometric
from cembench.results.papers import Paper


@dataclass(frozen=True)
class Quantity:
    """A figure of one algorithm: a column, or two where the paper printed it.

    Parameters
    ----------
    heading, title : str
        Heading of the pair, and of the measured column.
    series : Series or None
        The series; None if the run does not have the algorithm.
    figure : FrameColumn
        What is measured, and how it is written.
    column : (int, str) or None
        Its place in the paper: the table's number and the column's name.
    digits : int
        Printed digits after the decimal point.
    policy : str
        Its linear-algebra policy, if it is not that of the table.

    """

    heading: str
    series: AlgorithmSeries | None
    figure: FrameColumn
    column: tuple[int, str] | None = None
    digits: int = 2
    title: str = "here"
    policy: str = ""


@dataclass(frozen=True)
class Footer:
    """A row of aggregates over the numbers of each column with one of these titles, if any.

    With `over`, the numbers are divided by those of that group's column with the same title.
    """

    label: str
    of: Callable[[Sequence[float]], float]
    show: Callable[[float], str]
    titles: tuple[str, ...] = ()
    over: str = ""


def geometric_mean(numbers: Sequence[float]) -> float:
    """Return the geometric mean of positive numbers."""
    return float(geometric(np.asarray(numbers, dtype=float)))


def paper_value(paper: Paper, table: int, model: str, column: str, digits: int) -> Value:
    """Return a figure as printed in the paper; a misprint has a dagger and an explanation."""
    if model not in paper.tables[table]:
        return missing("the paper has no such model", "")
    number = paper.tables[table][model][column]
    if number is None:
        return missing(f"Table {table} of the paper has a dash here")
    why = paper.misprints.get((table, model, column), "")
    text = f"{number:,.{digits}f}" + ("†" if why else "")
    return Value(text, number, "printed", why=f"misprint: {why}" if why else "")


def here(
    evidence: Evidence, surface: MeasuredSurface, quantity: Quantity, policy: str | None
) -> Value:
    """Return a measured figure, or why there is none."""
    if quantity.series is None:
        return missing("the run does not have this algorithm")
    record = evidence.find(surface, quantity.series, quantity.policy or policy)
    if record is None:
        return missing(evidence.missing_reason(record))
    if record.outcome.status != "ok":
        text = record.outcome.status.replace("out_of_memory", "memory")
        return Value(text, None, "", record.cell.key, evidence.missing_reason(record), "bad")
    return figure_entry(evidence, record, quantity.figure)


def table_beside(
    evidence: Evidence,
    name: str,
    title: str,
    surfaces: Sequence[MeasuredSurface],
    quantities: Sequence[Quantity],
    *,
    policy: str | None = None,
    caption: str = "",
    footers: Sequence[Footer] = (),
    notes: Sequence[str] = (),
    absent: str = "",
) -> Table:
    """Return a table with one row per surface, and two columns per quantity printed in the paper.

    Other quantities have one column. Footers are computed per column, counting each of the paper's
    models once; a last row gives the number of values.
    """
    columns = [Column("surface", numeric=False), Column("faces")]
    for quantity in quantities:
        if quantity.column is not None:
            columns.append(Column("printed", quantity.heading))
        columns.append(Column(quantity.title, quantity.heading))
    rows = [_row(evidence, surface, quantities, policy) for surface in surfaces]
    counted = [
        r for s, r in zip(surfaces, rows, strict=True) if s not in evidence.stand_ins_left_out
    ]
    last = _footer_rows(counted, columns, footers)
    places = _places(columns, rows)
    sizes = _sizes(evidence.paper, surfaces)
    remarks = [*notes, *([absent] if absent else []), *places.values(), *sizes]
    return Table(
        name=name,
        title=title,
        columns=tuple(columns),
        rows=(*rows, *last),
        caption=caption,
        notes=tuple(remarks),
        absent=absent,
        places=places,
        footer_rows=len(last),
    )


def _row(
    evidence: Evidence, surface: MeasuredSurface, quantities: Sequence[Quantity], policy: str | None
) -> tuple[Value, ...]:
    cells = [words(surface.title), Value(f"{surface.faces:,}", surface.faces)]
    for quantity in quantities:
        if quantity.column is not None:
            number, column = quantity.column
            place = number, surface.paper_row, column
            cells.append(paper_value(evidence.paper, *place, quantity.digits))
        cells.append(here(evidence, surface, quantity, policy))
    return tuple(cells)


def _footer_rows(
    rows: Sequence[tuple[Value, ...]], columns: Sequence[Column], footers: Sequence[Footer]
) -> list[tuple[Value, ...]]:
    if not footers:
        return []
    lines, counts = [], [words("n, surfaces counted"), words("")]
    for number, footer in enumerate(footers):
        cells = [words(footer.label), words("")]
        for k, column in enumerate(columns[2:], start=2):
            if footer.titles and column.title not in footer.titles:
                cells.append(words(""))
                counts += [] if number else [words("")]
                continue
            found = _numbers(rows, columns, k, footer.over)
            value = footer.of(found) if found else None
            nothing = "nothing to compare" if footer.over else "no figure in this column"
            cells.append(entry(value, footer.show, nothing))
            counts += [] if number else [count(len(found))]
        lines.append(tuple(cells))
    return [*lines, tuple(counts)]


def _numbers(
    rows: Sequence[tuple[Value, ...]], columns: Sequence[Column], k: int, over: str
) -> list[float]:
    """Return the numbers of a column; with `over`, divided by those of that group's column."""
    places = [
        p
        for p, column in enumerate(columns)
        if (column.group, column.title) == (over, columns[k].title)
    ]
    found = []
    for row in rows:
        base = row[places[0]].number if places else 1.0 if not over else None
        number = row[k].number
        if number is not None and base:
            found.append(number / base if over else number)
    return found


def _places(columns: Sequence[Column], rows: Sequence[tuple[Value, ...]]) -> dict[str, str]:
    """Return the places of each cause of a gap, misprint or unstable time, as text."""
    found: dict[str, list[str]] = {}
    for row in rows:
        for column, value in zip(columns, row, strict=True):
            if value.why:
                paired = column.title in ("printed", "here")
                where = f"{row[0].text} / {column.group if paired else column.title}"
                found.setdefault(value.why, []).append(where)
    return {why: f"{why} ({'; '.join(dict.fromkeys(places))})" for why, places in found.items()}


def _sizes(paper: Paper, surfaces: Sequence[MeasuredSurface]) -> list[str]:
    """Return the surfaces whose size differs from that of the model in their row."""
    odd = [
        f"{s.title}: {s.faces:,} here, {paper.faces(s.paper_row):,} in print"
        for s in surfaces
        if s.paper_row and s.faces != paper.faces(s.paper_row)
    ]
    return [f"triangles differ from the paper's model ({'; '.join(odd)})"] if odd else []


def absent_models(evidence: Evidence) -> list[str]:
    """Return the models of the paper without a surface in the run."""
    there = {s.paper_row for s in evidence.models}
    return [model for model in evidence.paper.models if model not in there]


def in_policy(evidence: Evidence, policy: str) -> str:
    """Return the suffix of a title in a run with several policies."""
    return "" if len(evidence.policies) == 1 else f", solves: {policy}"


def policy_suffix(policy: str, evidence: Evidence) -> str:
    """Return the suffix of a name in a run with several policies; none for the first."""
    return "" if policy == evidence.policies[0] else f"-{policy}"


#: Notes that explain a table's policy.
POLICIES: Mapping[str, str] = {
    "reuse": "every algorithm reuses a factorisation as long as its matrix does not change",
    "backslash": "every solve factors again, as the paper's MATLAB code did",
}
