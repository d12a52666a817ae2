"""Tables with a row for each surface: figures of every algorithm, printed beside measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.declarations import Declaration
from cembench.report.document import Column, Origin, Table, Tone, Value, entry, missing, words
from cembench.results.columns import FITTED, FrameColumn, half_width, is_fitted, worded
from cembench.results.comparison import UNSTABLE_WIDTH
from cembench.results.frame import evaluate
from cembench.results.papers import Paper
from cembench.results.records import Record

#: What a table says of its linear-algebra policy.
POLICIES: Mapping[str, str] = {
    "reuse": "every algorithm reuses a factorisation as long as its matrix does not change",
    "backslash": "every solve factors again, as the paper's MATLAB code did",
}


@dataclass(frozen=True)
class Quantity:
    """A figure of one algorithm: a column, or two where the paper printed it.

    `heading` is that of the pair, `title` of the measured column. `series` is None if the run does
    not have the algorithm. `printed` is its place in the paper: the table's number, the column's
    name and the digits after the point. `policy` is the linear-algebra policy, if it is not that of
    the table.
    """

    heading: str
    series: AlgorithmSeries | None
    figure: FrameColumn
    printed: tuple[int, str, int] | None = None
    title: str = "here"
    policy: str = ""


class Footer(Declaration):
    """A row of aggregates over the numbers of each column with one of these titles, if any.

    `value` is an expression over the numbers, `x`; with `over`, they are divided by those of that
    group's column with the same title.
    """

    label: str
    value: str
    form: str = ".2f"
    titles: tuple[str, ...] = ()
    over: str = ""

    def of(self, numbers: Sequence[float]) -> float:
        """Return the aggregate of some numbers."""
        import pandas as pd

        return float(evaluate(self.value, pd.DataFrame({"x": numbers}, dtype=float)))

    def entry(self, numbers: Sequence[float], lacking: str) -> Value:
        """Return the aggregate as an entry; `lacking` says why there is none without numbers."""
        if not len(numbers):
            return missing(lacking)
        value = self.of(numbers)
        return Value(worded(value, self.form), value, "derived")


#: The geometric mean of a column of ratios.
MEAN_RATIO = Footer(label="geometric mean", value="geometric(x)", titles=("ratio",))


def figure_entry(evidence: Evidence, record: Record, column: FrameColumn) -> Value:
    """Return a figure of a record as an entry: with its origin, or why there is none."""
    number = column.of(record)
    key = record.cell.key
    if number is None:
        ended = record.outcome.status == "ok"
        why = column.why_lacking(record) if ended else evidence.missing_reason(record)
        return Value("-", None, "", key, why)
    text, why = column.text(number), ""
    if column.timed:
        if evidence.row(record)["unstable"]:
            why = f"unstable: its 95 % interval is wider than {UNSTABLE_WIDTH:.0%} of the figure"
        half = half_width(record)
        width = "" if half is None else f"±{half:.0f}%"
        parts = (text + "!" * bool(why), width, evidence.machines.of(record))
        text = " ".join(filter(None, parts))
    tone: Tone = "doubtful" if why else ""
    origin: Origin = evidence.by_hash[record.cell.mesh_hash].origin
    if origin == "stand-in" and column.name in FITTED and is_fitted(record):
        origin = "fitted"
    return Value(text, float(number), origin, key, why, tone)


def paper_value(paper: Paper, table: int, model: str, column: str, digits: int) -> Value:
    """Return a figure as printed in the paper; a misprint has a dagger and an explanation."""
    if model not in paper.tables[table]:
        return missing("the paper has no such model", "")
    number = paper.tables[table][model][column]
    if number is None:
        return missing(f"Table {table} of the paper has no figure here")
    why = paper.misprints.get((table, model, column), "")
    text = f"{number:,.{digits}f}" + ("†" if why else "")
    return Value(text, number, "printed", why=f"misprint: {why}" if why else "")


def _here(
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
    columns, rows = [Column("surface", numeric=False), Column("faces")], []
    for quantity in quantities:
        columns += [Column("printed", quantity.heading)] if quantity.printed else []
        columns.append(Column(quantity.title, quantity.heading))
    for surface in surfaces:
        row = [words(surface.title), Value(f"{surface.faces:,}", surface.faces)]
        for quantity in quantities:
            if quantity.printed:
                number, column, digits = quantity.printed
                model = surface.paper_row
                row.append(paper_value(evidence.paper, number, model, column, digits))
            row.append(_here(evidence, surface, quantity, policy))
        rows.append(tuple(row))
    left_out = evidence.stand_ins_left_out
    counted = [row for s, row in zip(surfaces, rows, strict=True) if s not in left_out]
    last = _footer_rows(counted, columns, footers) if footers else []
    places, sizes = _places(columns, rows), _sizes(evidence.paper, surfaces)
    remarks = (*notes, *([absent] if absent else []), *places.values(), *sizes)
    body = (*rows, *last)
    return Table(name, title, tuple(columns), body, caption, remarks, absent, places, len(last))


def _footer_rows(
    rows: Sequence[Sequence[Value]], columns: Sequence[Column], footers: Sequence[Footer]
) -> list[tuple[Value, ...]]:
    lines, counts = [], [words("n, surfaces counted"), words("")]
    for footer in footers:
        figures = [_numbers(rows, columns, k, footer) for k in range(2, len(columns))]
        lacking = "nothing to compare" if footer.over else "no figure in this column"
        cells = (words("") if n is None else footer.entry(n, lacking) for n in figures)
        lines.append((words(footer.label), words(""), *cells))
        if footer is footers[0]:
            counts += [words("") if n is None else entry(len(n), "d", "") for n in figures]
    return [*lines, tuple(counts)]


def _numbers(
    rows: Sequence[Sequence[Value]], columns: Sequence[Column], k: int, footer: Footer
) -> list[float] | None:
    """Return the numbers that a footer is of, in a column; None if it has none there."""
    title = columns[k].title
    if footer.titles and title not in footer.titles:
        return None
    numbers = [(row[k].number, 1.0) for row in rows]
    if footer.over:
        own = [p for p, one in enumerate(columns) if (one.group, one.title) == (footer.over, title)]
        numbers = [(row[k].number, row[p].number or 0.0) for row in rows for p in own[:1]]
    return [number / base for number, base in numbers if number is not None and base]


def _places(columns: Sequence[Column], rows: Sequence[Sequence[Value]]) -> dict[str, str]:
    """Return the places of each cause of a gap, misprint or unstable time, as text."""
    causes: dict[str, dict[str, dict[str, None]]] = {}
    for row in rows:
        for column, value in zip(columns, row, strict=True):
            if value.why:
                name = column.group if column.title in ("printed", "here") else column.title
                causes.setdefault(value.why, {}).setdefault(name, {})[row[0].text] = None
    every = len({row[0].text for row in rows})
    return {
        why: f"{why} ({'; '.join(_place(name, list(of), every) for name, of in places.items())})"
        for why, places in causes.items()
    }


def _place(name: str, surfaces: Sequence[str], every: int) -> str:
    """Return "FDM: face, hand" or, where a table has many surfaces, "FDM: all"."""
    all_of_many = len(surfaces) == every > 2
    return f"{name}: {'all' if all_of_many else ', '.join(surfaces)}"


def _sizes(paper: Paper, surfaces: Sequence[MeasuredSurface]) -> list[str]:
    """Return the surfaces whose size differs from that of the model in their row."""
    odd = [
        f"{s.title}: {s.faces:,} here, {paper.faces(s.paper_row):,} in print"
        for s in surfaces
        if s.paper_row and s.faces != paper.faces(s.paper_row)
    ]
    return [f"triangles differ from the paper's model ({'; '.join(odd)})"] if odd else []


def in_policy(evidence: Evidence, policy: str) -> str:
    """Return the suffix of a title in a run with several policies."""
    return "" if len(evidence.policies) == 1 else f", solves: {policy}"


def policy_suffix(policy: str, evidence: Evidence) -> str:
    """Return the suffix of a name in a run with several policies; none for the first."""
    return "" if policy == evidence.policies[0] else f"-{policy}"
