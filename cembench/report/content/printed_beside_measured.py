"""Printed and measured figures side by side, the common form of Tables 1 to 4."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.document import Column, Table, Value, count, missing, words
from cembench.results.comparison import UNSTABLE_WIDTH
from cembench.results.papers import Paper
from cembench.results.records import Record

Number = float | int | None


@dataclass(frozen=True)
class Quantity:
    """A pair of columns with a figure of one algorithm, printed and measured.

    Parameters
    ----------
    heading : str
        Heading of the pair.
    series : Series or None
        The series; None if the run does not have the algorithm.
    measured : function of a record
        Returns the figure, or None if the record has none.
    show : function of a number
        Formats a measured figure.
    column : (int, str) or None
        Its place in the paper: the table's number and the column's name.
    digits : int
        Printed digits after the decimal point.
    timed : bool
        Whether it depends on the stability of the times.
    title : str
        Heading of the measured column.

    """

    heading: str
    series: AlgorithmSeries | None
    measured: Callable[[Record], Number]
    show: Callable[[float], str]
    column: tuple[int, str] | None = None
    digits: int = 2
    timed: bool = False
    title: str = "here"


@dataclass(frozen=True)
class Footer:
    """A row of aggregates over the numbers of each column; None for none."""

    label: str
    of: Callable[[Sequence[float]], float]
    show: Callable[[float], str]


def significant(number: float, digits: int = 3) -> str:
    """Return a number with this many significant digits, without an exponent if possible."""
    if number == 0 or not 1e-5 <= abs(number) < 10**6:
        return f"{number:.{digits}g}"
    whole = len(f"{abs(number):.0f}") if abs(number) >= 1 else 0
    if whole >= digits:
        return f"{number:,.0f}"
    leading = 0
    while whole == 0 and abs(number) < 10 ** -(leading + 1):
        leading += 1
    return f"{number:.{digits - whole + leading}f}"


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
    record = evidence.find(surface, quantity.series, policy)
    if record is None:
        return missing(evidence.missing_reason(record))
    if record.outcome.status != "ok":
        text = record.outcome.status.replace("out_of_memory", "memory")
        return Value(text, None, "", record.cell.key, evidence.missing_reason(record))
    number = quantity.measured(record)
    if number is None:
        return Value("-", None, "", record.cell.key, "the record holds no such figure")
    why = ""
    if quantity.timed and evidence.row(record)["unstable"]:
        why = f"unstable: its 95 % interval is wider than {UNSTABLE_WIDTH:.0%} of the figure"
    text = quantity.show(number) + ("!" if why else "")
    if quantity.timed:
        text = f"{text} {evidence.machines.of(record)}".rstrip()
    return Value(text, float(number), surface.origin, record.cell.key, why)


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
    last = _footer_rows(counted, len(columns), footers)
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
    rows: Sequence[tuple[Value, ...]], width: int, footers: Sequence[Footer]
) -> list[tuple[Value, ...]]:
    if not footers:
        return []
    columns = [[r[k].number for r in rows if r[k].number is not None] for k in range(2, width)]
    lines = []
    for footer in footers:
        cells = [
            Value(footer.show(footer.of(c)), footer.of(c), "derived")  # type: ignore[arg-type]
            if c
            else missing("no figure in this column")
            for c in columns
        ]
        lines.append((words(footer.label), words(""), *cells))
    counts = [count(len(c)) for c in columns]
    return [*lines, (words("n, surfaces counted"), words(""), *counts)]


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


def metric(name: str) -> Callable[[Record], Number]:
    """Return a function that gets this metric from a record; None if infinite or missing."""
    return lambda record: record.outcome.metrics.get(name)


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
