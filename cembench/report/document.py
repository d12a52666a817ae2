"""What a report holds, whatever it is rendered to.

A number is made once, as a :class:`Value` with its origin and the record it was read from;
Markdown, LaTeX, CSV, HTML and the terminal only print it. Figures are files beside their data.

What lies in a report's folder, whoever writes it: :func:`csv_of` and :func:`tex_of` say where a
table is, a figure's paths are its own, and ``records.csv`` holds every record as a row.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Any, Literal, TypeAlias

#: Where a figure comes from; a table never puts two of these into one column without a mark.
Origin = Literal["printed", "model", "stand-in", "surface", "derived", ""]

#: What a reader is told of an origin, and the mark behind a number of it.
ORIGINS: Mapping[Origin, tuple[str, str]] = {
    "printed": ("printed in the paper", "ᵖ"),
    "model": ("measured here on the paper's own model", "ᵐ"),
    "stand-in": ("measured here on a stand-in for the paper's model", "ˢ"),
    "surface": ("measured here on a surface that is not in the paper", ""),
    "derived": ("computed from other figures of this report", ""),
}

#: Does a claim of the paper hold in this run?
Verdict = Literal[
    "holds", "holds in part", "does not hold here", "not tested here", "too few rounds"
]


@dataclass(frozen=True)
class Value:
    """One entry of a table.

    Parameters
    ----------
    text : str
        As it is printed, in every form of the report.
    number : float or None
        The same with full precision, by which a column is sorted; None for words and gaps.
    origin : Origin
        Where the number comes from.
    record : str
        Key of the record that it was read from; empty for printed and derived ones.
    why : str
        Why there is no number, or what is to be known of it (a misprint, an unstable time).

    """

    text: str
    number: float | None = None
    origin: Origin = ""
    record: str = ""
    why: str = ""


@dataclass(frozen=True)
class Column:
    """A column; neighbours of equal `group` stand under one heading.

    In a table of the paper, `group` is the algorithm and `title` is "printed" or "here".
    """

    title: str
    group: str = ""
    unit: str = ""
    numeric: bool = True


@dataclass(frozen=True)
class Table:
    """A table; `name` is its file name and anchor, `rows` are as long as `columns`."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]
    caption: str = ""
    #: Below the table: how many surfaces an aggregate runs over, misprints, causes of gaps.
    notes: tuple[str, ...] = ()
    #: The one among the notes that names surfaces which the run lacks; empty where it lacks none.
    absent: str = ""
    #: Those among the notes that tell where a cause holds, by the cause, as `Value.why` has it.
    places: Mapping[str, str] = field(default_factory=dict)
    #: Rows at the end that hold aggregates; sorting leaves them where they are.
    footer_rows: int = 0


@dataclass(frozen=True)
class Figure:
    """A picture or plot, as files relative to the report's folder.

    Parameters
    ----------
    files : tuple of PurePosixPath
        The same figure in each form it has: PNG, SVG, PDF; the first one is shown.
    data : PurePosixPath or None
        The CSV that it was drawn from.
    plot : mapping or None
        The same as a Plotly figure in JSON, for forms that can be zoomed; None for pictures.
    alternative : str
        What a reader who cannot see it should know.
    paper : str
        The paper's figure that it regenerates, as "Figure 8"; empty for others.

    """

    name: str
    title: str
    files: tuple[PurePosixPath, ...]
    caption: str = ""
    data: PurePosixPath | None = None
    plot: Mapping[str, Any] | None = None
    alternative: str = ""
    paper: str = ""


@dataclass(frozen=True)
class Gallery:
    """Figures that are looked at side by side: one surface, a picture for every algorithm.

    `scene` is the same to be turned, for forms that can (:mod:`cembench.drawing.view_scene`).
    """

    name: str
    title: str
    figures: tuple[Figure, ...]
    caption: str = ""
    scene: bytes = b""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper's text, put to the test.

    Parameters
    ----------
    name : str
        Anchor.
    sentence, place : str
        The paper's words, and where they stand.
    test : str
        How it is tested here.
    figures : str
        What came out, with n.
    remark : str
        What is to be known of the verdict: on what it was tested, and on what not.

    """

    name: str
    sentence: str
    place: str
    test: str
    figures: str
    verdict: Verdict
    remark: str = ""


@dataclass(frozen=True)
class Gap:
    """Something that has a place in the report but is not there; `command` would make it."""

    title: str
    why: str
    command: str = ""


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    words: str


Item: TypeAlias = "Table | Figure | Gallery | Claim | Gap | Text"


@dataclass(frozen=True)
class Section:
    """A part of the report; `page` gives it a page of its own where a form has pages."""

    name: str
    title: str
    items: tuple[Item, ...] = ()
    sections: tuple[Section, ...] = ()
    page: bool = False


@dataclass(frozen=True)
class Finding:
    """A figure that a run found, and what it is of."""

    number: str
    words: str


@dataclass(frozen=True)
class Findings:
    """What a run found, for the head of its report.

    `picture` and `plot` are figures that stand in the report too.
    """

    sentence: str
    figures: tuple[Finding, ...] = ()
    picture: Figure | None = None
    plot: Figure | None = None


@dataclass(frozen=True)
class Report:
    """A whole report.

    `command` is the one that makes it again; `facts` are what stands at its head (machine, date,
    versions, cells by status) as pairs of words.
    """

    title: str
    command: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    #: Records by key, as rows (cembench.results.record_rows), to which the values link.
    records: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    findings: Findings | None = None


def missing(why: str, text: str = "-") -> Value:
    """A gap in a table; `why` says why there is no number."""
    return Value(text, why=why)


def words(text: str) -> Value:
    """An entry that is no number."""
    return Value(text)


def marked(value: Value, column: Column) -> str:
    """The text with the mark of its origin; none where the column's heading says "printed"."""
    mark = ORIGINS[value.origin][1] if value.origin else ""
    says = value.origin == "printed" and column.title.startswith("printed")
    return value.text if says or value.number is None else value.text + mark


def csv_of(table: Table) -> PurePosixPath:
    """Where is a table's CSV, relative to the report's folder?"""
    return PurePosixPath("tables", f"{table.name}.csv")


def tex_of(table: Table) -> PurePosixPath:
    """Where is a table's LaTeX, relative to the report's folder?"""
    return PurePosixPath("tables", f"{table.name}.tex")


def sections_of(report: Report) -> Iterator[tuple[int, Section]]:
    """All sections in the order of reading, each with its depth from 1."""

    def below(depth: int, sections: tuple[Section, ...]) -> Iterator[tuple[int, Section]]:
        for section in sections:
            yield depth, section
            yield from below(depth + 1, section.sections)

    return below(1, report.sections)


def tables_of(report: Report) -> Iterator[Table]:
    """All tables in the order of reading."""
    for _, section in sections_of(report):
        yield from (item for item in section.items if isinstance(item, Table))


def galleries_of(report: Report) -> Iterator[Gallery]:
    """All galleries in the order of reading."""
    for _, section in sections_of(report):
        yield from (item for item in section.items if isinstance(item, Gallery))


def figures_of(report: Report) -> Iterator[Figure]:
    """All figures in the order of reading, also those of galleries."""
    for _, section in sections_of(report):
        for item in section.items:
            if isinstance(item, Figure):
                yield item
            elif isinstance(item, Gallery):
                yield from item.figures
