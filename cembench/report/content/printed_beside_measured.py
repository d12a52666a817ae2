"""What was measured beside what the paper printed: the form that Tables 1 to 4 share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.document import Column, Table, Value, missing, words
from cembench.results import paper
from cembench.results.comparison import UNSTABLE_WIDTH
from cembench.results.records import Record

Number = float | int | None


@dataclass(frozen=True)
class Quantity:
    """A pair of columns: a figure of one algorithm, printed and measured.

    Parameters
    ----------
    heading : str
        Over the pair.
    series : Series or None
        Whose figure it is; None where the run does not have the algorithm.
    measured : function of a record
        The figure, or None where the record has none.
    show : function of a number
        How a measured figure is written.
    column : (int, str) or None
        Where it is printed: the number of the paper's table and the name of its column.
    digits : int
        Digits after the point in print.
    timed : bool
        Whether it depends on how steady the times were.

    """

    heading: str
    series: AlgorithmSeries | None
    measured: Callable[[Record], Number]
    show: Callable[[float], str]
    column: tuple[int, str] | None = None
    digits: int = 2
    timed: bool = False


@dataclass(frozen=True)
class Footer:
    """A line of aggregates: of the numbers of a column, None where there are none."""

    label: str
    of: Callable[[Sequence[float]], float]
    show: Callable[[float], str]


def significant(number: float, digits: int = 3) -> str:
    """A number with so many significant digits, never in powers of ten where that is avoidable."""
    if number == 0 or not 1e-5 <= abs(number) < 10**6:
        return f"{number:.{digits}g}"
    whole = len(f"{abs(number):.0f}") if abs(number) >= 1 else 0
    if whole >= digits:
        return f"{number:,.0f}"
    leading = 0
    while whole == 0 and abs(number) < 10 ** -(leading + 1):
        leading += 1
    return f"{number:.{digits - whole + leading}f}"


def paper_value(table: int, model: str, column: str, digits: int) -> Value:
    """A figure as the paper prints it; a misprint with a dagger and what is wrong with it."""
    if model not in paper.table(table):
        return missing("the paper has no such model", "")
    number = paper.table(table)[model][column]
    if number is None:
        return missing(f"Table {table} of the paper has a dash here")
    why = paper.ERRATA.get((table, model, column), "")
    text = f"{number:,.{digits}f}" + ("†" if why else "")
    return Value(text, number, "printed", why=f"misprint: {why}" if why else "")


def here(
    evidence: Evidence, surface: MeasuredSurface, quantity: Quantity, policy: str | None
) -> Value:
    """A figure as it was measured, or why there is none."""
    if quantity.series is None:
        return missing("the run does not have this algorithm")
    record = evidence.find(surface, quantity.series, policy)
    if record is None:
        return missing(evidence.why_not(record))
    if record.outcome.status != "ok":
        text = record.outcome.status.replace("out_of_memory", "memory")
        return Value(text, None, "", record.cell.key, evidence.why_not(record))
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
    """One row a surface, two columns a quantity that the paper prints, one for others.

    Footers are taken over each column on its own, each of the paper's models counting once; a last
    line says over how many numbers.
    """
    columns = [Column("surface", numeric=False), Column("faces")]
    for quantity in quantities:
        if quantity.column is not None:
            columns.append(Column("printed", quantity.heading))
        columns.append(Column("here", quantity.heading))
    rows = [_row(evidence, surface, quantities, policy) for surface in surfaces]
    counted = [r for s, r in zip(surfaces, rows, strict=True) if s not in evidence.set_aside]
    last = _footer_rows(counted, len(columns), footers)
    places = _places(columns, rows)
    remarks = [*notes, *([absent] if absent else []), *places.values(), *_sizes(surfaces)]
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
            cells.append(paper_value(number, surface.paper_row, column, quantity.digits))
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
    counts = [Value(str(len(c)), len(c), "derived") for c in columns]
    return [*lines, (words("n, surfaces counted"), words(""), *counts)]


def _places(columns: Sequence[Column], rows: Sequence[tuple[Value, ...]]) -> dict[str, str]:
    """Where each cause of a gap, a misprint or an unsteady time holds, in words."""
    found: dict[str, list[str]] = {}
    for row in rows:
        for column, value in zip(columns, row, strict=True):
            if value.why:
                where = f"{row[0].text} / {column.group}"
                found.setdefault(value.why, []).append(where)
    return {why: f"{why} ({'; '.join(dict.fromkeys(places))})" for why, places in found.items()}


def _sizes(surfaces: Sequence[MeasuredSurface]) -> list[str]:
    """Surfaces that have another size than the model whose row they are in."""
    odd = [
        f"{s.title}: {s.faces:,} here, {paper.faces(s.paper_row):,} in print"
        for s in surfaces
        if s.paper_row and s.faces != paper.faces(s.paper_row)
    ]
    return [f"triangles differ from the paper's model ({'; '.join(odd)})"] if odd else []


def absent_models(evidence: Evidence) -> list[str]:
    """Models of the paper that no surface of the run is or stands for."""
    there = {s.paper_row for s in evidence.models}
    return [model for model in paper.table(1) if model not in there]


def metric(name: str) -> Callable[[Record], Number]:
    """The figure of this name out of a record; None where it is infinite or not there."""
    return lambda record: record.outcome.metrics.get(name)


def in_policy(evidence: Evidence, policy: str) -> str:
    """What a title adds where a run solves in several ways."""
    return "" if len(evidence.policies) == 1 else f", solves: {policy}"


def policy_suffix(policy: str, evidence: Evidence) -> str:
    """What a name adds where a run solves in several ways: the first has none."""
    return "" if policy == evidence.policies[0] else f"-{policy}"


#: What a table's notes say of where its numbers come from, by what is in it.
POLICIES: Mapping[str, str] = {
    "reuse": "a factor is kept while its matrix stands, for every algorithm alike",
    "backslash": "every solve factors anew, as the paper's MATLAB did",
}
