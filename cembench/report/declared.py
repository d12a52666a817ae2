"""Tables that are declared: a title, the rows, and for each column what it shows.

A declaration is a part of a TOML file, ``tables.toml`` here or one that ``report --tables`` names.
Its rows are records, algorithms with figures over their records, or surfaces with figures of each
algorithm::

    [by-target]
    title = "Angle errors by algorithm"
    rows = "algorithm"
    where = "target == 'disk'"
    columns = [
      { title = "maps", value = "count(ok)" },
      { title = "median", unit = "degrees", value = "median(angle_error_mean_deg)", form = ".2f" },
    ]

With ``rows = "cause"`` a row has the records on the surfaces that are hard for one reason
(:mod:`cembench.report.content.causes`). Columns of records and surfaces name a column of the frame
(:mod:`cembench.results.columns`); the others are expressions (:mod:`cembench.results.frame`). Every
entry keeps its record's key, its origin, and why it has no number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from cembench.core.errors import ParameterError
from cembench.report.by_surface import (
    POLICIES,
    Footer,
    Quantity,
    figure_entry,
    in_policy,
    table_beside,
)
from cembench.report.content.causes import by_cause
from cembench.report.content.evidence import DISK, Evidence, MeasuredSurface
from cembench.report.declarations import Declaration, filled, own, parsed
from cembench.report.document import Column, Table, Value, entry, of_status, words
from cembench.results.columns import (
    COLUMNS,
    FrameColumn,
    is_free,
    mark_of,
    marks_explained,
    seconds_words,
    worded,
)
from cembench.results.frame import evaluate
from cembench.results.frame import filled as filled_in
from cembench.results.records import Record

if TYPE_CHECKING:
    import pandas as pd


def _with_mark(name: str, record: Record) -> str:
    return f"{name} {mark_of(record)}".rstrip()


def _star(record: Record) -> str:
    return "" if record.target == DISK else " *"


def named(record: Record) -> str:
    """Return an algorithm's name with marks for another target and for external code."""
    return _with_mark(record.cell.algorithm + _star(record), record)


def _ending(record: Record) -> str:
    folds = record.outcome.metrics.get("flipped_triangles")
    return f"{folds:,} folds" if folds else record.outcome.status


#: Columns of a table of records that say which it is, and how it ended: the text of each, from its
#: row of the frame and the record.
_NAMES: Mapping[str, Callable[[Mapping[str, Any], Record], str]] = {
    "surface": lambda row, _: row["surface"],
    "algorithm": lambda row, _: row["label"],
    "starred": lambda row, record: row["label"] + _star(record),
    "marked": lambda row, record: _with_mark(row["label"], record),
    "called": lambda _, record: _with_mark(record.cell.algorithm, record),
    "named": lambda _, record: named(record),
    "target": lambda _, record: record.target,
    "solves": lambda _, record: record.cell.solves,
    "status": lambda _, record: record.outcome.status,
    "ending": lambda _, record: _ending(record),
    "cause": lambda _, record: record.outcome.cause or "",
}
_HEADINGS = dict.fromkeys(("starred", "marked", "called", "named"), "algorithm") | {"ending": ""}


class DeclaredColumn(Declaration):
    """A column: of a record's figure (`column`) or of an expression over a group (`value`)."""

    column: str = ""
    value: str = ""
    #: Of a value: how it is written, with expressions in braces, and why it may be missing.
    text: str = ""
    lacking: str = "no figure"
    title: str = ""
    group: str = ""
    unit: str = ""
    form: str = "significant"
    #: Of surfaces: the linear-algebra policy of its records; default: that of the table.
    solves: str = ""
    #: Whether its entries are texts.
    words: bool = False
    #: Left out where it is zero or missing in every row.
    optional: bool = False
    #: An expression for the key of the record behind the entry.
    record: str = ""

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        return {"column": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _known(self) -> DeclaredColumn:
        if bool(self.column) == bool(self.value):
            raise ValueError('a column has either "column" or "value"')
        if self.column and self.column not in COLUMNS and self.column not in _NAMES:
            known = ", ".join((*_NAMES, *COLUMNS))
            raise ValueError(f"there is no column {self.column!r}; known: {known}")
        return self

    @property
    def heading(self) -> Column:
        """The heading in the table."""
        known = COLUMNS.get(self.column)
        usual = known.heading if known else self.column
        title = self.title or _HEADINGS.get(self.column, usual)
        kept = known is not None and not self.group and known.unit in ("s", "MiB")
        unit = self.unit or (known.unit if known and kept else "")
        numeric = not (self.words or self.column in _NAMES)
        return Column(title, self.group, unit, numeric)


class DeclaredTable(Declaration):
    """A table; `where` is an expression, true for the records that it is about."""

    title: str
    columns: tuple[DeclaredColumn, ...] = Field(min_length=1)
    rows: Literal["record", "algorithm", "name", "surface", "cause"] = "record"
    where: str = ""
    #: Of algorithms: what the first column is called.
    heading: str = ""
    #: Further columns, expressions over all the records that the table is about.
    given: Mapping[str, str] = {}
    #: "first": the run's first linear-algebra policy; "all".
    policy: Literal["first", "all"] = "first"
    #: Columns of the frame by which the records of a surface are sorted.
    sort: tuple[str, ...] = ()
    caption: str = ""
    #: What is said below the table: what marks mean, why cells did not end ok, their notices.
    notes: tuple[Literal["marks", "targets", "causes", "notices"], ...] = ()
    #: Of surfaces: rows of aggregates below the others.
    footers: tuple[Footer, ...] = ()

    @model_validator(mode="after")
    def _fits(self) -> DeclaredTable:
        takes_columns = self.rows == "record"
        wrong = [c for c in self.columns if bool(c.value) == takes_columns]
        if wrong and self.rows != "surface":
            what = "columns (column)" if takes_columns else "expressions (value)"
            raise ValueError(f'rows = "{self.rows}" takes {what}, not {wrong[0].title!r}')
        if self.rows == "surface" and any(
            not c.value and c.column not in COLUMNS for c in self.columns
        ):
            raise ValueError(f'rows = "surface" takes columns of figures: {", ".join(COLUMNS)}')
        return self


@cache
def own_tables() -> Mapping[str, DeclaredTable]:
    """Return the tables that every report can have."""
    return parsed(own("tables.toml"), DeclaredTable, "tables.toml")


def declared_table(
    evidence: Evidence,
    name: str,
    declared: DeclaredTable | None = None,
    *,
    keys: Iterable[str] | None = None,
    surfaces: Sequence[MeasuredSurface] = (),
    notes: Sequence[str] = (),
    called: str = "",
    policy: str = "",
    **texts: str,
) -> Table | None:
    """Return a declared table over a run; None if no record is in it.

    Parameters
    ----------
    evidence : Evidence
        The run.
    name : str
        Name of the table.
    declared : DeclaredTable, optional
        The table; default: the one of :func:`own_tables` with this name.
    keys : iterable of str, optional
        Only these records.
    surfaces : sequence of MeasuredSurface, optional
        The rows of a table of surfaces, in order; default: all that have a record in it.
    notes : sequence of str, optional
        More notes, before those declared.
    called : str
        Another name for the table's file and anchor.
    policy : str
        The linear-algebra policy of its records; default: what the declaration says.
    texts : str
        What braces in title and caption stand for, besides ``{policy}``.
    """
    spec = declared or own_tables()[name]
    held = (policy,) if policy else evidence.policies[: None if spec.policy == "all" else 1]
    policy = policy or evidence.policies[0]
    chosen = evidence.frame["solves"].isin(held)
    if keys is not None:
        chosen &= evidence.frame["key"].isin(list(keys))
    frame = evidence.frame[chosen]
    if spec.where and len(frame):
        frame = frame[evaluate(spec.where, frame).astype(bool)]
    if frame.empty:
        return None
    if spec.sort:
        frame = frame.sort_values(["place", *spec.sort], kind="stable", na_position="last")
    once = " Each model counts once, and is preferred over its stand-in."
    known = {"policy": policy, "in_policy": in_policy(evidence, policy), "n": str(len(frame))}
    known |= {"surfaces": str(frame["place"].nunique())}
    known |= {"once": once if evidence.stand_ins_left_out else ""}
    known |= {"reference": evidence.reference_label, "to": "", **texts}
    below = tuple(dict.fromkeys((*notes, *_notes(evidence, spec, frame))))
    if spec.rows == "surface":
        return _of_surfaces(evidence, spec, frame, surfaces, called or name, known, below)
    columns, entries = zip(*_columns(evidence, spec, frame, known), strict=True)
    title, caption = filled(spec.title, known), filled(spec.caption, known)
    return Table(called or name, title, columns, tuple(zip(*entries, strict=True)), caption, below)


def _of_surfaces(
    evidence: Evidence,
    spec: DeclaredTable,
    frame: pd.DataFrame,
    surfaces: Sequence[MeasuredSurface],
    name: str,
    about: Mapping[str, str],
    notes: Sequence[str],
) -> Table:
    """Return a table of surfaces: columns by algorithm if each names it in its group."""
    surfaces = surfaces or [evidence.surfaces[place] for place in frame["place"].unique()]
    series = [evidence.series[k] for k in sorted(frame["series"].unique())]
    policy, *several = frame["solves"].unique()
    policy = None if several else policy
    known = {**about, "surfaces": len(surfaces), "here": POLICIES.get(policy or "", str(policy))}
    quantities = []
    for one in spec.columns:
        for s in series:
            star = " *" * (s.target != DISK and "targets" in spec.notes)
            texts = {**known, "algorithm": s.label + star}
            group, title = (filled(text, texts) for text in (one.group, one.heading.title))
            figure = COLUMNS.get(one.column) or _computed(evidence, one)
            quantities.append(Quantity(group, s, figure, title=title, policy=one.solves))
    if all("{algorithm}" in one.group for one in spec.columns):
        quantities = [one for k in range(len(series)) for one in quantities[k :: len(series)]]
    footers = [
        one.model_copy(update={key: filled(getattr(one, key), known) for key in ("label", "over")})
        for one in spec.footers
    ]
    title, caption = filled(spec.title, known), filled(spec.caption, known)
    return table_beside(
        evidence, name, title, surfaces, quantities,
        policy=policy, caption=caption, footers=footers, notes=notes,
    )  # fmt: skip


def _computed(evidence: Evidence, one: DeclaredColumn) -> FrameColumn:
    """Return a column of an expression over the records of an algorithm on a surface."""
    frame = evidence.frame

    def of(record: Record) -> Any:
        own = frame[frame["key"] == record.cell.key].iloc[0]
        return evaluate(
            one.value, frame[(frame["place"] == own["place"]) & (frame["series"] == own["series"])]
        )

    return FrameColumn(one.value, of, form=one.form, lacking=one.lacking)


def _columns(
    evidence: Evidence, spec: DeclaredTable, frame: pd.DataFrame, known: Mapping[str, str]
) -> list[tuple[Column, list[Value]]]:
    """Return the columns with their entries, those that are optional only if they hold some."""
    first: list[tuple[Column, list[Value]]] = []
    if spec.rows == "record":
        rows = frame[["key", "surface", "label"]].to_dict("records")
        made = [[_entry(evidence, row, one) for row in rows] for one in spec.columns]
    else:
        frame = frame.assign(**{name: evaluate(of, frame) for name, of in spec.given.items()})
        frame = frame.sort_values("series", kind="stable")
        groups = (
            by_cause(evidence, frame)
            if spec.rows == "cause"
            else list(frame.groupby("algorithm" if spec.rows == "name" else "label", sort=False))
        )
        title = filled(spec.heading, known) or spec.rows
        first = [(Column(title, numeric=False), [words(str(label)) for label, _ in groups])]
        made = [[aggregate(one, group) for _, group in groups] for one in spec.columns]
    return first + [
        (replace(one.heading, title=filled(one.heading.title, known)), values)
        for one, values in zip(spec.columns, made, strict=True)
        if not one.optional or any(value.number for value in values)
    ]


def _entry(evidence: Evidence, row: Mapping[str, Any], one: DeclaredColumn) -> Value:
    record, name = evidence.by_key[row["key"]], one.column
    if name in ("status", "ending"):
        cause = record.outcome.cause or ""
        return of_status(_NAMES[name](row, record), record=row["key"], why=cause)
    if name in _NAMES:
        return words(_NAMES[name](row, record))
    value = COLUMNS[name].of(record)
    if one.words or isinstance(value, str):
        return words(str(value or "-"))
    return figure_entry(evidence, record, COLUMNS[name])


def aggregate(one: DeclaredColumn, group: pd.DataFrame) -> Value:
    """Return the value of a column over a group of rows."""
    value = evaluate(one.value, group)
    if hasattr(value, "iloc"):
        raise ParameterError(
            f"{one.value!r} has a value for each record; take one, e.g. median({one.value})."
        )
    if one.words:
        return words("-" if value is None else str(value))
    key = str(evaluate(one.record, group) or "") if one.record else ""
    if isinstance(value, str):
        return Value(value, None, "derived")
    form = (lambda _: filled_in(one.text, group)) if one.text else partial(worded, form=one.form)
    return entry(value, form, one.lacking, record=key)


def _notes(evidence: Evidence, spec: DeclaredTable, frame: pd.DataFrame) -> Iterable[str]:
    records = [evidence.by_key[key] for key in frame["key"]]
    if "marks" in spec.notes:
        yield from marks_explained(records)
    several = frame["place"].nunique() > 1
    for row, record in zip(frame.to_dict("records"), records, strict=True):
        surface = f"{row['surface']}, " if several else ""
        where = f"{surface}{row['label']} ({record.cell.solves})"
        if "causes" in spec.notes and record.outcome.status != "ok":
            yield f"{where}: {evidence.missing_reason(record)}"
        if "notices" in spec.notes:
            if text := seconds_words(record):
                yield f"{where}: {text}"
            yield from (f"{where}: {note}" for note in record.outcome.notes)
    others = sorted({record.target for record in records} - {DISK})
    if "targets" in spec.notes and others:
        free = any(is_free(target) for target in others)
        yield (
            f"* not a map to the disk ({', '.join(others)}): compare it with maps to the same "
            f"target{'; E_C is over the area of the image, whose size is free' if free else ''}"
        )
