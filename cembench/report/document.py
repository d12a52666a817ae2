"""The contents of a report, independent of its output format.

A number is made once, as a :class:`Value` with its origin and the record it was read from.
Markdown, LaTeX, CSV, HTML and the terminal only print it. Figures are files with their data.

Files in a report's folder: :func:`csv_of` and :func:`tex_of` give the paths of a table, a figure
holds its own paths, and ``records.csv`` has every record as a row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cembench.results.papers import Paper

T = TypeVar("T")
#: Origin of a number; a table never mixes two origins in a column without a mark.
Origin = Literal["printed", "model", "stand-in", "fitted", "surface", "derived", ""]

#: Description of each origin, and the mark after its numbers.
ORIGINS: Mapping[Origin, tuple[str, str]] = {
    "printed": ("printed in the paper", "ᵖ"),
    "model": ("measured here on the paper's own model", "ᵐ"),
    "stand-in": ("measured here on a stand-in for the paper's model", "ˢ"),
    "fitted": (
        "measured here on a stand-in that was fitted to this printed figure: it decides nothing",
        "ᶠ",
    ),
    "surface": ("measured here on a surface that is not in the paper", ""),
    "derived": ("computed from other figures of this report", ""),
}

#: How a terminal shows an entry.
Tone = Literal["", "good", "doubtful", "bad", "faint"]

#: Verdict on a claim of the paper.
Verdict = Literal[
    "holds", "holds in part", "does not hold here", "not tested here", "too few rounds"
]
#: All verdicts, failing ones first, with their words for one claim and for several.
VERDICTS: Mapping[Verdict, tuple[str, str]] = {
    "does not hold here": ("does not hold here", "do not hold here"),
    "holds in part": ("holds in part", "hold in part"),
    "holds": ("holds", "hold"),
    "too few rounds": ("has too few rounds", "have too few rounds"),
    "not tested here": ("is not tested here", "are not tested here"),
}

#: The verdict whose claims are named where verdicts are counted.
FAILING: Verdict = "does not hold here"

#: Texts of a column longer than this many characters are broken into lines.
LONG = 36
#: Heading of the suspect maps at the head of a report.
SUSPECTS = "Mean angle errors over three times those of the other algorithms"


@dataclass(frozen=True)
class Value:
    """One entry of a table.

    Parameters
    ----------
    text : str
        The text printed in every form of the report.
    number : float or None
        The same with full precision, for sorting; None for words and gaps.
    origin : Origin
        Origin of the number.
    record : str
        Key of its record; empty for printed and derived numbers.
    why : str
        Why there is no number, or a remark on it (a misprint, an unstable time).
    tone : Tone
        How a terminal shows it.
    """

    text: str
    number: float | None = None
    origin: Origin = ""
    record: str = ""
    why: str = ""
    tone: Tone = ""


#: An entry of a table as :meth:`Table.of` takes it.
Plain: TypeAlias = "Value | str | float | None"


@dataclass(frozen=True)
class Column:
    """A column; neighbours with the same `group` share a heading.

    In a table of the paper, `group` is the algorithm and `title` is "printed" or "here".
    """

    title: str
    group: str = ""
    unit: str = ""
    numeric: bool = True
    #: Format of the numbers that :meth:`Table.of` is given, and why one may be missing.
    form: str = ""
    lacking: str = "no figure"
    #: Whether a terminal that is too narrow leaves it out.
    detail: bool = False


class OnTerminal:
    """What a console of rich prints as :mod:`cembench.report.render.terminal` lays it out."""

    def __rich__(self) -> RenderableType:
        """Return it for a terminal."""
        from cembench.report.render.terminal import on_terminal

        return on_terminal(self)


@dataclass(frozen=True)
class Table(OnTerminal):
    """A table; `name` is its file name and anchor, and each row has an entry per column."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]
    caption: str = ""
    #: Notes below the table: numbers of surfaces in aggregates, misprints, causes of gaps.
    notes: tuple[str, ...] = ()
    #: The note on surfaces missing in the run; empty if there are none.
    absent: str = ""
    #: The notes that list the places of a cause, by the cause (`Value.why`).
    places: Mapping[str, str] = field(default_factory=dict)
    #: Number of aggregate rows at the end, which are not sorted.
    footer_rows: int = 0

    @classmethod
    def of(
        cls,
        name: str,
        title: str,
        columns: Sequence[Column | str],
        rows: Iterable[Sequence[Plain]],
        *,
        origin: Origin = "derived",
        **more: Any,
    ) -> Table:
        """Return a table of plain entries: texts, numbers, and None for a gap.

        A column that is only a title holds texts.
        """
        held = [Column(one, numeric=False) if isinstance(one, str) else one for one in columns]
        made = tuple(
            tuple(_of_column(one, column, origin) for one, column in zip(row, held, strict=True))
            for row in rows
        )
        return cls(name, title, tuple(held), made, **more)

    def only(self, places: Sequence[int]) -> Table:
        """Return the table with these columns alone."""
        columns = tuple(self.columns[k] for k in places)
        rows = tuple(tuple(row[k] for k in places) for row in self.rows)
        return replace(self, columns=columns, rows=rows)


@dataclass(frozen=True)
class Figure:
    """A picture or plot, as files relative to the report's folder.

    Parameters
    ----------
    files : tuple of PurePosixPath
        The figure in each of its formats (PNG, SVG, PDF); the first one is shown.
    data : PurePosixPath or None
        The CSV file with its data.
    plot : mapping or None
        The same as a Plotly figure in JSON, for interactive forms; None for pictures.
    alternative : str
        Text for readers who cannot see it.
    paper : str
        The paper's figure that it reproduces; empty for others.
    record : str
        Key of the record whose map it shows; empty for others.
    """

    name: str
    title: str
    files: tuple[PurePosixPath, ...]
    caption: str = ""
    data: PurePosixPath | None = None
    plot: Mapping[str, Any] | None = None
    alternative: str = ""
    paper: str = ""
    record: str = ""

    @property
    def full_title(self) -> str:
        """The title, after the paper's figure that it reproduces."""
        return f"{self.paper}: {self.title}" if self.paper else self.title


@dataclass(frozen=True)
class Gallery:
    """Figures shown side by side: one surface, with a picture for every algorithm.

    `scene` is an interactive 3-D version (:mod:`cembench.drawing.view_scene`).
    """

    name: str
    title: str
    figures: tuple[Figure, ...]
    caption: str = ""
    scene: bytes = b""


@dataclass(frozen=True)
class Judged:
    """A claim's test on surfaces of one origin, or on the printed figures.

    `on` says on how many of what, `figures` what was found, and `counted` how many tests hold.
    """

    on: str
    figures: str
    verdict: Verdict = "not tested here"
    counted: str = ""

    @property
    def counted_verdict(self) -> str:
        """The verdict with how many tests hold."""
        return ", ".join(filter(None, (self.verdict, self.counted)))

    @property
    def sentence(self) -> str:
        """The verdict and what it rests on."""
        on, figures = self.on[0].upper() + self.on[1:], self.figures.rstrip(".")
        return f"{on}: {self.counted_verdict} ({figures})."


@dataclass(frozen=True)
class Claim:
    """A claim of the paper's text with its test.

    Parameters
    ----------
    name : str
        Anchor.
    sentence, place : str
        The paper's words and their place.
    test : str
        How the claim is tested here.
    figures : str
        Result of the test, with n.
    remark : str
        Remarks on the verdict, such as the surfaces it was tested on.
    plain : str
        What it says in a few words.
    counted : str
        How many tests hold; of tests on surfaces, with the 95 % interval of the share of families.
    parts : mapping
        The verdicts apart, by origin of the surfaces, models first; "printed" is a control on the
        printed tables. `verdict` and `counted` are those of the first.
    """

    name: str
    sentence: str
    place: str
    test: str
    figures: str
    verdict: Verdict
    remark: str = ""
    plain: str = ""
    counted: str = ""
    parts: Mapping[str, Judged] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The anchor in words, for links."""
        return self.name.replace("-", " ")


@dataclass(frozen=True)
class Gap:
    """A missing item of the report; `command` would make it."""

    title: str
    why: str
    command: str = ""


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    words: str


Item: TypeAlias = "Table | Figure | Gallery | Claim | Gap | Text"


@dataclass(frozen=True)
class Section(OnTerminal):
    """A part of the report; with `page`, it has its own page in forms with pages."""

    name: str
    title: str
    items: tuple[Item, ...] = ()
    sections: tuple[Section, ...] = ()
    page: bool = False


@dataclass(frozen=True)
class Finding:
    """A key figure of a run, with its description."""

    number: str
    words: str


#: A sentence in parts; a claim is a link to itself.
Sentence: TypeAlias = "tuple[str | Claim, ...]"


@dataclass(frozen=True)
class Findings:
    """The key findings of a run, for the head of its report.

    Parameters
    ----------
    sentences : tuple of Sentence
        The headline, then further sentences.
    suspects : tuple of str
        Maps that are far worse than the others on their surface.
    tables : tuple of Table
        The paper's main claims; or the standings of each target, and the run's own figures.
    figures : tuple of Finding
        Key figures.
    picture, plot : Figure or None
        They also occur in the report.
    """

    sentences: tuple[Sentence, ...]
    suspects: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Finding, ...] = ()
    picture: Figure | None = None
    plot: Figure | None = None


@dataclass(frozen=True, repr=False)
class Report:
    """A whole report.

    `command` makes the report again; `facts` are shown at its head (machine, date, versions, cells
    by status), as pairs of texts. `paper` is the paper that the report is about, if any.
    """

    title: str
    command: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    #: Records by key, as rows (cembench.results.columns), that the values link to.
    records: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    findings: Findings | None = None
    paper: Paper | None = None
    #: The page that it was written to, if any.
    page: Path | None = None

    def __repr__(self) -> str:
        """Return the title and the page, a line each."""
        return f"{self.title}: {len(self.records)} records\n{self.page or 'not written'}"

    def _repr_html_(self) -> str:
        link = f"<a href='{escape(str(self.page))}'>{escape(str(self.page))}</a>"
        about = f"{escape(self.title)}: {len(self.records)} records"
        return f"{about}<br>{link if self.page else 'not written'}"


def missing(why: str, text: str = "-") -> Value:
    """Return a gap in a table; `why` says why there is no number."""
    return Value(text, why=why)


def words(text: str, tone: Tone = "") -> Value:
    """Return an entry that is not a number."""
    return Value(text, tone=tone)


def entry(
    number: float | None,
    form: str | Callable[[float], str],
    why: str,
    *,
    origin: Origin = "derived",
    record: str = "",
) -> Value:
    """Return a number in a format, or a gap; `why` says why there is no number."""
    if number is None:
        return Value("-", record=record, why=why)
    text = format(number, form) if isinstance(form, str) else form(number)
    return Value(text, number, origin, record)


def of_status(status: str, record: str = "", why: str = "") -> Value:
    """Return how a cell ended as an entry."""
    tones: Mapping[str, Tone] = {"ok": "good", "skipped": "doubtful"}
    return Value(status, None, "", record, why, tones.get(status, "bad"))


def _of_column(one: Plain, column: Column, origin: Origin) -> Value:
    if isinstance(one, Value):
        return one
    if isinstance(one, str):
        return words(one)
    form = column.form or ("," if isinstance(one, int) else ".6g")
    made = entry(one, form, column.lacking, origin=origin)
    return made if one is None else replace(made, number=float(one))


def heading(column: Column) -> str:
    """Return group, title and unit as one heading."""
    named = " ".join(part for part in (column.group, column.title) if part)
    return f"{named} [{column.unit}]" if column.unit else named


def groups_of(columns: Sequence[Column]) -> list[tuple[str, int]]:
    """Return the headings of groups with their numbers of columns; empty without groups."""
    lengths = [(name, len(list(run))) for name, run in groupby(column.group for column in columns)]
    return lengths if any(name for name, _ in lengths) else []


def is_prose(table: Table, place: int) -> bool:
    """Whether a column holds texts that are too long for one line."""
    longest = max((len(row[place].text) for row in table.rows), default=0)
    return longest > LONG and not table.columns[place].numeric


def plain(sentence: Sentence) -> str:
    """Return a sentence as text without links."""
    return "".join(part if isinstance(part, str) else part.title for part in sentence)


def marked(value: Value, column: Column) -> str:
    """Return the text with the mark of its origin, unless the heading says "printed"."""
    mark = ORIGINS[value.origin][1] if value.origin else ""
    says = value.origin == "printed" and column.title.startswith("printed")
    return value.text if says or value.number is None else value.text + mark


def csv_of(table: Table) -> PurePosixPath:
    """Return the path of a table's CSV, relative to the report's folder."""
    return PurePosixPath("tables", f"{table.name}.csv")


def tex_of(table: Table) -> PurePosixPath:
    """Return the path of a table's LaTeX, relative to the report's folder."""
    return PurePosixPath("tables", f"{table.name}.tex")


def sections_of(report: Report) -> Iterator[Section]:
    """Yield all sections in reading order."""

    def below(sections: tuple[Section, ...]) -> Iterator[Section]:
        for section in sections:
            yield section
            yield from below(section.sections)

    return below(report.sections)


def items_of(report: Report, kind: type[T]) -> Iterator[T]:
    """Yield all items of a kind in reading order; the figures of galleries are figures."""
    findings = report.findings
    if findings is not None:
        yield from (table for table in findings.tables if isinstance(table, kind))
    for section in sections_of(report):
        for item in section.items:
            if isinstance(item, kind):
                yield item
            elif isinstance(item, Gallery):
                yield from (figure for figure in item.figures if isinstance(figure, kind))
