"""Papers: folders of data with printed tables, misprints, claims and how the paper was run.

A folder holds `paper.toml`, `tables.toml` with the CSV files that it names and, if wanted,
`runs.toml`, `figures.toml`, `claims.toml`, `measured.toml` with tables and plots of what was
measured, and `checks.py`, the numerics of claims. `papers/cem` is an example. Installed papers are
found by the entry points of the group ``cembench.papers``, each of which names the package that is
the folder.
"""

from __future__ import annotations

import csv
import importlib
import importlib.util
import re
import sys
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal
from urllib.parse import quote

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from cembench.core.errors import ParameterError, RegistryError, describe_error
from cembench.core.names import digest
from cembench.results.expressions import with_words
from cembench.results.intervals import DEFAULT_ROUNDS
from cembench.results.profiles import Profile

if TYPE_CHECKING:
    from cembench.registry import Algorithm

#: Group of the entry points of papers.
GROUP = "cembench.papers"
#: Files that a paper need not have.
_OPTIONAL = ("runs.toml", "figures.toml", "claims.toml")
#: Fields in which names in braces stand for words and numbers.
_PROSE = frozenset({"title", "caption", "quote", "place", "test", "remark"})
REMEDY = "Repair it; papers/cem is an example."
#: The file that a part of a paper is in; others are in paper.toml.
_ELSEWHERE = {
    **dict.fromkeys(("folder", "package"), ""),
    **dict.fromkeys(("tables", "printed", "errata"), "tables.toml"),
    **dict.fromkeys(("claims", "numbers"), "claims.toml"),
    "runs": "runs.toml",
    "plots": "figures.toml",
}

#: The rows of a claim by default: on models of the paper, or on any surface if it names none.
OF_MODELS, OF_ANY = "ok & main & chosen & model.notna()", "ok & main & chosen"

#: Printed figures of a model by column; None where the paper has a dash.
Row = Mapping[str, float | None]


class Declaration(BaseModel):
    """A part of a declaration, which has no other keys than its own."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _known(cls, given: Any) -> Any:
        for name in given if isinstance(given, Mapping) else ():
            if name not in cls.model_fields and cls.model_config["extra"] == "forbid":
                raise ValueError(_unknown(name, cls.model_fields))
        return given


class ProfileLimits(Declaration):
    """The number of smallest models in `quick`, and the most triangles of one in `standard`.

    `budgets` are the seconds after which cells get no more rounds, by profile.
    """

    quick: int = 8
    standard: int = 210_000
    budgets: Mapping[Profile, float] = {}


class Picture(Declaration):
    """A figure that shows one model with its map."""

    figure: str
    model: str
    shows: tuple[Literal["checkerboard", "curvature", "mesh"], ...] = ("checkerboard",)


class PlottedFigure(Declaration):
    """A figure that a plot shows, with a panel for each model where it has any.

    Its other keys declare the plot (:mod:`cembench.report.declared_plots`).
    """

    model_config = ConfigDict(frozen=True, extra="allow")
    figure: str = ""
    models: tuple[str, ...] = ()


class ExpectedExhibit(Declaration):
    """A figure that a command of cembench adds to a run, as an exhibit of this kind.

    With `models` it is one only for surfaces that are, or stand in for, these, in this order.
    """

    figure: str
    shows: str
    command: str
    exhibit: str
    models: tuple[str, ...] = ()


class PrintedFigure(Declaration):
    """A figure of each algorithm in a printed table.

    `column` names it in the frame of a run ("rate": the rate of speedup of the reference), and
    `printed` in the paper's table, with the algorithm in braces. `heading` follows the algorithm's
    title; with `only`, one algorithm has it.
    """

    column: str
    printed: str = "{}"
    heading: str = ""
    digits: int = 2
    only: str = ""
    #: The unit that seconds are printed in; they are shown in seconds.
    unit: Literal["s", "ms", "min"] = "s"


class PrintedTable(Declaration):
    """A table that shows its printed figures beside measured ones."""

    title: str
    caption: str = ""
    notes: tuple[str, ...] = ()
    figures: tuple[PrintedFigure, ...] = ()
    #: Whether it depends on the linear-algebra policy; then each policy has one.
    by_policy: bool = False
    #: Whether it compares the other algorithms with the reference; then it ends with averages.
    compares: bool = False
    #: The addresses at which its cells are printed.
    sources: tuple[str, ...] = ()


class Erratum(Declaration):
    """A printed cell that contradicts the rest of the paper."""

    table: int
    model: str
    column: str
    reason: str


class HowRun(Declaration):
    """A parameter with which the paper ran an algorithm on its own models, and elsewhere's value.

    Without `models` it is all of them.
    """

    algorithm: str
    parameter: str
    printed: Any
    elsewhere: Any
    models: tuple[str, ...] = ()


class StatedClaim(Declaration):
    """A sentence of the paper with its test on a run.

    The test is made of expressions (:mod:`cembench.results.frame`), in which the numbers of the
    file and the public functions of the folder's `checks.py` are known too. Some of the frame's
    rows are grouped to cases, a surface each as a rule, and each case is decided. Fields that
    several claims share may be in the file's ``[cases.NAME]``: a claim with ``cases = "NAME"`` has
    them unless it has its own.

    Parameters
    ----------
    name, quote, place, test, remark : str
        Its name, the paper's words, their place, the test in words, and what is to be said of it.
    plain : str
        What it says in a few plain words, for the list of all claims (default: the quote).
    rows : str
        Which rows of the frame it is about: by default those on models, or on any surface if the
        paper names no model.
    algorithms : tuple of str
        Only rows of these, and only cases that have them all.
    per : tuple of str
        Columns that make a case; they are single values in the expressions below. Without any, all
        rows are one case.
    each : mapping of str to str
        Values of a case by name, for the further expressions; a case is left out if one is None.
    holds, of : str
        Whether it holds for a case, or in how many of how many tests.
    lacking : str
        How many tests of a case lack rounds: they decide nothing.
    figures, none, further : str
        The result in words, what is said instead without any case, and what follows the remark:
        texts with expressions in braces, in which the values of the cases are columns, and `held`
        and `tested` are numbers.
    on : tuple of {"measured", "printed"}
        What it is tested on: the run's surfaces, those of each origin apart, and the printed
        tables, as a control.
    """

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    quote: str
    place: str
    test: str
    plain: str = ""
    rows: str = OF_MODELS
    algorithms: tuple[str, ...] = ()
    per: tuple[str, ...] = ("place", "surface")
    each: Mapping[str, str] = {}
    holds: str
    of: str = "1"
    lacking: str = "0"
    figures: str = (
        "true on {held} of {tested} surfaces{listed('; not on ', surface[~holds], between=', ')}"
    )
    none: str = "no surface of this run is one that it is about"
    further: str = ""
    on: tuple[Literal["measured", "printed"], ...] = ("measured",)
    remark: str = ""


class Paper(Declaration):
    """A paper: what it printed, how it ran its algorithms, and what it claims."""

    #: The folder, and the package that it is if it is installed.
    folder: Path = Path()
    package: str = ""
    title: str
    authors: str
    #: The journal with volume, year and pages.
    place: str
    doi: str
    #: Under their names in cembench, in the order of the columns.
    algorithms: tuple[str, ...]
    #: The one that the others are compared with.
    reference: str
    #: What it was measured on.
    machine: str = ""
    profiles: ProfileLimits = ProfileLimits()
    #: What its rate of speedup is.
    rate: str = "the rate of speedup, t / t_reference - 1"
    #: Averages in its text, by what is averaged and by algorithm.
    stated: Mapping[Literal["rate", "saving"], Mapping[str, float]] = {}
    #: Models that are registered surfaces, at the printed number of triangles, or public meshes.
    surfaces: Mapping[str, str] = {}
    #: Models that show one object: their surfaces count as one in intervals.
    families: Mapping[str, tuple[str, ...]] = {}
    #: Notes on the table of factorisations and solves, with expressions over the frame in braces.
    work_notes: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    plots: Mapping[str, PlottedFigure] = {}
    exhibits: tuple[ExpectedExhibit, ...] = ()
    #: The printed tables with their misprints, by number, model and column.
    tables: Mapping[int, Mapping[str, Row]] = {}
    printed: Mapping[int, PrintedTable] = {}
    errata: tuple[Erratum, ...] = ()
    runs: tuple[HowRun, ...] = ()
    claims: tuple[StatedClaim, ...] = ()
    #: The names of the main claims, for the head of a report (default: failing ones first).
    headline: tuple[str, ...] = ()
    #: Numbers that the claims name.
    numbers: Mapping[str, Any] = {}

    @property
    def address(self) -> str:
        """The address that the doi resolves to."""
        return f"https://doi.org/{quote(self.doi, safe='/:;,()+=')}"

    @property
    def compared(self) -> tuple[str, ...]:
        """The algorithms that the reference is compared with."""
        return tuple(a for a in self.algorithms if a != self.reference)

    @property
    def models(self) -> tuple[str, ...]:
        """The models of the tables, in the paper's order; without tables those of `surfaces`."""
        printed = tuple(dict.fromkeys(model for rows in self.tables.values() for model in rows))
        return printed or tuple(self.surfaces)

    def table_of(self, column: str) -> int | None:
        """Return the number of the printed table with this column of the frame, if any."""
        numbers = (n for n, t in self.printed.items() if column in {f.column for f in t.figures})
        return next(numbers, None)

    @property
    def misprints(self) -> Mapping[tuple[int, str, str], str]:
        """The reason for each misprinted cell, by table, model and column."""
        return {(one.table, one.model, one.column): one.reason for one in self.errata}

    def count(self, model: str, what: Literal["vertices", "faces"]) -> int:
        """Return the number of vertices or triangles of a model; 0 if no table has it."""
        counts = (rows.get(model, {}).get(what) for rows in self.tables.values())
        return int(next((number for number in counts if number is not None), 0))

    def faces(self, model: str) -> int:
        """Return the number of triangles of a model."""
        return self.count(model, "faces")

    def model_of(self, surface: str, faces: int) -> str:
        """Return the model that a surface of this name and size is by `surfaces`, or ""."""
        named = (model for model, name in self.surfaces.items() if name == surface)
        return next((model for model in named if self.faces(model) in (0, faces)), "")

    def object_of(self, model: str) -> str:
        """Return what a model shows: the name of its family, or its own."""
        return next((name for name, held in self.families.items() if model in held), model)

    def plotted(self, plot: str) -> PlottedFigure:
        """Return the figure that is plotted in this way; an empty one if there is none."""
        return self.plots.get(plot, PlottedFigure())

    def exhibited(self, exhibit: str, models: Sequence[str] = ()) -> str:
        """Return the figure that an exhibit of this kind on these models is; "" if none."""
        of_kind = (one for one in self.exhibits if one.exhibit == exhibit)
        return next((one.figure for one in of_kind if one.models in ((), tuple(models))), "")

    def as_printed(self, model: str, algorithms: Iterable[Algorithm]) -> dict[str, Any]:
        """Return the parameters with which the paper ran algorithms on this model of its own.

        They are in the form that `plan_cells` takes.
        """
        known = {a.name: {parameter.name for parameter in a.parameters} for a in algorithms}
        return {
            f"{run.algorithm}.{run.parameter}": run.printed
            for run in self.runs
            if run.parameter in known.get(run.algorithm, ()) and model in (run.models or [model])
        }

    def as_elsewhere(self, algorithm: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """Return a cell's parameters with those of :attr:`runs` as on other surfaces."""
        changed = {run.parameter: run for run in self.runs if run.algorithm == algorithm}
        return {
            name: changed[name].elsewhere
            if name in changed and value == changed[name].printed
            else value
            for name, value in parameters.items()
        }

    def printed_figure(self, column: str, algorithm: str, model: str) -> float | None:
        """Return what a table prints of a model's map for this column of the frame, if anything."""
        number = self.table_of(column)
        if number is None or model not in self.tables[number]:
            return None
        figure = next(one for one in self.printed[number].figures if one.column == column)
        return self.tables[number][model].get(with_words(figure.printed, algorithm))

    def functions(self) -> dict[str, Callable[..., Any]]:
        """Return the public functions of the folder's `checks.py`, by name.

        Raises
        ------
        RegistryError
            It cannot be imported.
        """
        file = self.folder / "checks.py"
        if not file.is_file():
            return {}
        package = self.package or _package_of(self.folder)
        try:
            loaded = importlib.import_module(f"{package}.checks")
        except Exception as error:
            raise _wrong(file, "cannot be imported", describe_error(error)) from error
        return {
            name: value
            for name, value in vars(loaded).items()
            if isinstance(value, FunctionType)
            and value.__module__.startswith(f"{package}.")
            and not name.startswith("_")
        }


#: What a report without any paper has instead.
NO_PAPER = Paper(title="", authors="", place="", doi="", algorithms=(), reference="")


def _package_of(folder: Path) -> str:
    """Return the name of a package below which the modules of a folder can be imported."""
    package = ModuleType(f"cembench_paper_{digest(str(folder))}")
    package.__path__ = [str(folder)]
    return sys.modules.setdefault(package.__name__, package).__name__


def read_paper(folder: Path, package: str = "") -> Paper:
    """Read a paper from its folder.

    Parameters
    ----------
    folder : Path
        The folder.
    package : str
        The package that it is, if it is installed.

    Raises
    ------
    RegistryError
        A file is missing or cannot be read, or holds something else than allowed.
    """
    folder = folder.absolute()
    of_paper = [name for name in Paper.model_fields if name not in _ELSEWHERE]
    about = _read_toml(folder / "paper.toml", of_paper)
    listed = _read_toml(folder / "tables.toml", ("tables", "errata"))
    claimed = _read_toml(folder / "claims.toml", ("numbers", "words", "cases", "claims"))
    words = {"machine": about.get("machine", ""), "fewest_rounds": DEFAULT_ROUNDS}
    printed, tables = {}, {}
    for entry in _spelled_out(folder / "tables.toml", listed, "tables", words):
        number, file = entry.pop("number", None), entry.pop("file", None)
        if not isinstance(number, int) or not isinstance(file, str):
            raise _wrong(folder / "tables.toml", "tables", "needs a number and the name of a file")
        if number in tables:
            raise _wrong(folder / "tables.toml", "tables", f"table {number} occurs twice")
        tables[number] = _scaled(_read_table(folder / file), entry, about.get("algorithms", ()))
        printed[number] = entry
    parts = {
        **about,
        "tables": tables,
        "printed": printed,
        "errata": listed.get("errata", ()),
        "plots": _read_toml(folder / "figures.toml"),
        "runs": _read_toml(folder / "runs.toml", ("runs",)).get("runs", ()),
        "claims": _spelled_out(folder / "claims.toml", claimed, "claims", words),
        "numbers": claimed.get("numbers", {}),
        "folder": folder,
        "package": package,
    }
    try:
        paper = Paper.model_validate(parts)
    except ValidationError as error:
        first = error.errors()[0]
        file = folder / _ELSEWHERE.get(str(first["loc"][0]), "paper.toml")
        what = first["msg"].removeprefix("Value error, ")
        what = what[0].lower() + what[1:]
        raise _wrong(file, ".".join(map(str, first["loc"])), what) from error
    for name, where, what in _unmatched(paper):
        raise _wrong(folder / name, where, what)
    if not paper.models:
        everywhere = [
            claim.model_copy(update={"rows": OF_ANY}) if claim.rows == OF_MODELS else claim
            for claim in paper.claims
        ]
        paper = paper.model_copy(update={"claims": tuple(everywhere)})
    return paper


def _unmatched(paper: Paper) -> Iterator[tuple[str, str, str]]:
    """Yield where one part of a paper names what another does not have: file, place, what."""
    if paper.reference not in paper.algorithms:
        known = ", ".join(paper.algorithms)
        what = f"{paper.reference!r} is none of the paper's algorithms ({known})"
        yield "paper.toml", "reference", what
    for number, model, column in paper.misprints:
        if column not in paper.tables.get(number, {}).get(model, {}):
            yield "tables.toml", "errata", f"table {number} has no cell {column!r} of {model!r}"
    named = [*paper.surfaces, *(picture.model for picture in paper.pictures)]
    named += [model for one in paper.plots.values() for model in one.models]
    named += [model for one in paper.runs for model in one.models]
    named += [model for one in paper.exhibits for model in one.models]
    named += [model for held in paper.families.values() for model in held]
    for model in named:
        if model not in paper.models:
            what = f"no printed table has it; known: {', '.join(paper.models)}"
            yield "", f"model {model!r}", what
    for model in paper.models if paper.tables else ():
        if not paper.faces(model):
            yield "tables.toml", "tables", f"no table has the column 'faces' for {model!r}"
    names = [claim.name for claim in paper.claims]
    for name in paper.headline:
        if name not in names:
            what = f"there is no claim {name!r}; known: {', '.join(names) or 'none'}"
            yield "paper.toml", "headline", what
    for name in names:
        if names.count(name) > 1:
            yield "claims.toml", f"claim {name!r}", "occurs twice"


def _wrong(file: Path, where: str, what: str) -> RegistryError:
    return RegistryError(f"{file}: {where}: {what}. {REMEDY}")


def _read_text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise RegistryError(f"{file} of a paper cannot be read: {why}. {REMEDY}") from error


def _read_toml(file: Path, allowed: Collection[str] | None = None) -> dict[str, Any]:
    """Return what a file holds under these names, or any; nothing if it is left out and may be."""
    if file.name in _OPTIONAL and not file.exists():
        return {}
    try:
        read = tomllib.loads(_read_text(file))
    except tomllib.TOMLDecodeError as error:
        raise RegistryError(f"{file} is not TOML: {error}. {REMEDY}") from error
    for name in read:
        if allowed is not None and name not in allowed:
            raise _wrong(file, "at the top", _unknown(name, allowed))
    return read


def _unknown(name: str, allowed: Iterable[str]) -> str:
    return f"{name!r} is not known here; allowed are {', '.join(allowed)}"


def _entries(file: Path, read: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """Return the tables ``[[name]]`` of a file."""
    entries = read.get(name, [])
    if not isinstance(entries, list) or not all(isinstance(one, dict) for one in entries):
        raise _wrong(file, name, f"write each as a table [[{name}]]")
    return entries


#: How tables write that there is no figure.
_GAPS = frozenset({"", "-", "\u2013", "\u2014", "n/a", "na", "nan", "none"})
_NUMBER = re.compile(r"[+-]?\d+(?:,\d{3})*(?:\.\d*)?(?:e[+-]?\d+)?|[+-]?\.\d+", re.IGNORECASE)


def cell_number(text: str) -> float | None:
    """Return the number in a cell of a printed table, or None for a gap.

    A deviation after ± is left out; commas may group thousands.

    Raises
    ------
    ValueError
        It is neither.

    Examples
    --------
    >>> cell_number("54.5 ± 2.1"), cell_number("12,345"), cell_number("n/a")
    (54.5, 12345.0, None)
    """
    figure = text.partition("±")[0].partition("+/-")[0].strip()
    if figure.lower() in _GAPS:
        return None
    if not _NUMBER.fullmatch(figure):
        raise ValueError(f"{text!r} is not a number")
    return float(figure.replace(",", ""))


def _scaled(
    table: dict[str, dict[str, float | None]], entry: Mapping[str, Any], algorithms: Sequence[str]
) -> dict[str, dict[str, float | None]]:
    """Return a table with its figures of time in seconds, whatever unit they are printed in."""
    figures = entry.get("figures", ())
    for figure in figures if isinstance(figures, list) else ():
        unit = figure.get("unit", "s") if isinstance(figure, dict) else "s"
        if unit not in _SECONDS or unit == "s":
            continue
        power = _SECONDS[unit]
        figure["digits"] = max(0, figure.get("digits", 2) + (3 if unit == "ms" else 0))
        names = {figure.get("printed", "{}").format(name) for name in algorithms}
        for row in table.values():
            row |= {name: v * power for name in names if (v := row.get(name)) is not None}
    return table


#: Units of time in seconds.
_SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "min": 60.0}


def _read_table(file: Path) -> dict[str, dict[str, float | None]]:
    """Return the rows of a CSV file by its first column; gaps are None."""
    lines = list(csv.reader(_read_text(file).splitlines()))
    header, *rows = lines or [[]]
    table: dict[str, dict[str, float | None]] = {}
    for k, row in enumerate(rows, 2):
        if len(row) != len(header):
            raise _wrong(file, f"line {k}", f"{len(row)} cells, under {len(header)} headings")
        if row[0] in table:
            raise _wrong(file, f"line {k}", f"the model {row[0]!r} occurs twice")
        table[row[0]] = {}
        for column, cell in zip(header[1:], row[1:], strict=True):
            try:
                table[row[0]][column] = cell_number(cell)
            except ValueError as error:
                where = f"line {k}, column {column!r}"
                allowed = "allowed are 54.5, 54.5 ± 2.1, and n/a, a dash or nothing for a gap"
                raise _wrong(file, where, f"{error}; {allowed}") from error
    return table


def _spelled_out(
    file: Path, read: Mapping[str, Any], name: str, known: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Return the tables ``[[name]]`` of a file, what names in braces stand for in their prose.

    They are those given, the file's ``[numbers]``, and its ``[words]``, which may hold the others.
    A table with `cases` has also what ``[cases]`` has under that name.
    """
    try:
        known = {**known, **read.get("numbers", {})}
        known |= {
            key: with_words(str(text), **known) for key, text in read.get("words", {}).items()
        }
        return [
            {
                key: with_words(text, **known) if key in _PROSE and isinstance(text, str) else text
                for key, text in one.items()
            }
            for one in map(partial(_with_cases, file, read), _entries(file, read, name))
        ]
    except ValueError as error:
        raise _wrong(file, name, str(error)) from error
    except LookupError as error:
        what = f"{{{error}}} is no word of [words]; known: {', '.join(known) or 'none'}"
        raise _wrong(file, name, what) from error


def _with_cases(file: Path, read: Mapping[str, Any], claim: dict[str, Any]) -> dict[str, Any]:
    """Return a claim with the fields of its `cases`, and what they and it have under `each`."""
    shared, name = read.get("cases", {}), claim.pop("cases", None)
    if name is None:
        return claim
    if name not in shared:
        what = f"there is no [cases.{name}]; known: {', '.join(shared) or 'none'}"
        raise _wrong(file, f"claim {claim.get('name')!r}", what)
    return {**shared[name], **claim, "each": shared[name].get("each", {}) | claim.get("each", {})}


@lru_cache(maxsize=1)
def papers() -> Mapping[str, Paper]:
    """Return the installed papers by the name of their entry point, cembench's own first.

    Raises
    ------
    RegistryError
        An entry point names no folder of a paper.
    """

    def place(entry: EntryPoint) -> tuple[bool, str]:
        return entry.dist is None or entry.dist.name != "cembench", entry.name

    return {one.name: _installed(one) for one in sorted(entry_points(group=GROUP), key=place)}


def _installed(entry: EntryPoint) -> Paper:
    try:
        spec = importlib.util.find_spec(entry.module)
    except ImportError:
        spec = None
    places = list(spec.submodule_search_locations or ()) if spec else []
    if not places:
        raise RegistryError(
            f"entry point {entry.name} = {entry.value!r} of group {entry.group!r} is not the "
            "package of a paper's folder. Repair or uninstall the package that declares it."
        )
    return read_paper(Path(places[0]), entry.module)


def find_paper(named: str, *, trust: bool = False) -> Paper:
    """Return the installed paper of this name, or the one in this folder.

    With `trust`, a folder that is not installed may have a checks.py, which runs as the user.

    Raises
    ------
    RegistryError
        There is neither, or the folder holds no paper.
    ParameterError
        The folder has a checks.py, and is not trusted.
    """
    code = code_of(named)
    if code is not None and not trust:
        raise ParameterError(
            f"{code} would run with your rights, as part of a paper that is not installed. Read "
            "it, and add `trust` if you trust its authors."
        )
    if named in papers():
        return papers()[named]
    if not Path(named).is_dir():
        known = ", ".join(papers()) or "none"
        raise RegistryError(
            f"{named!r} is neither an installed paper nor a folder; installed: {known}. Name one "
            "of them, or a folder with a paper.toml."
        )
    return read_paper(Path(named))


def code_of(named: str) -> Path | None:
    """Return the checks.py of a paper's folder that is not installed, if it has one."""
    code = Path(named) / "checks.py"
    folders = {paper.folder.resolve() for paper in papers().values()}
    is_strange = named not in papers() and code.parent.resolve() not in folders
    return code if is_strange and code.is_file() else None


def usual_paper() -> Paper:
    """Return the paper that profiles and reports are of where no other is named.

    It is the first that has ``[profiles]``.
    """
    known = sorted(papers().values(), key=lambda paper: "profiles" not in paper.model_fields_set)
    return next(iter(known), NO_PAPER)


def paper_of(model: str) -> Paper:
    """Return the first paper that has this model in its tables; without one, an empty paper."""
    return next((paper for paper in papers().values() if model in paper.models), NO_PAPER)
