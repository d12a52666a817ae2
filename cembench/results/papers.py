"""Papers: folders of data with printed tables, misprints, claims and how the paper was run.

A folder holds `paper.toml`, `tables.toml` with the CSV files that it names and, if wanted,
`runs.toml`, `figures.toml`, `claims.toml` and the Python modules that test claims. `papers/cem` is
an example. Installed papers are found by the entry points of the group ``cembench.papers``, each of
which names the package that is the folder.
"""

from __future__ import annotations

import csv
import importlib
import importlib.util
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from cembench.core.errors import RegistryError, describe_error
from cembench.core.names import digest

if TYPE_CHECKING:
    from cembench.registry import Algorithm

#: Group of the entry points of papers.
GROUP = "cembench.papers"
REMEDY = "Repair it; papers/cem is an example."
#: The file that a part of a paper is in; others are in paper.toml.
_FILES = {"runs": "runs.toml", "claims": "claims.toml", "plots": "figures.toml"} | dict.fromkeys(
    ("tables", "printed", "errata"), "tables.toml"
)

#: Printed figures of a model by column; None where the paper has a dash.
Row = Mapping[str, float | None]


@dataclass(frozen=True)
class Citation:
    """Where a paper was published; `place` is the journal with volume, year and pages."""

    title: str
    authors: str
    place: str
    doi: str

    @property
    def address(self) -> str:
        """The address that the doi resolves to."""
        return f"https://doi.org/{self.doi}"


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ProfileLimits(_Part):
    """The number of smallest models in `quick`, and the most triangles of one in `standard`."""

    quick: int = 8
    standard: int = 210_000


class Picture(_Part):
    """A figure that shows one model with its map."""

    figure: str
    model: str
    shows: tuple[Literal["checkerboard", "curvature", "mesh"], ...] = ("checkerboard",)


class PlottedFigure(_Part):
    """A figure that a plot shows, with a panel for each model where it has any.

    Its other keys declare the plot (:mod:`cembench.report.declared_plots`).
    """

    model_config = ConfigDict(frozen=True, extra="allow")
    figure: str = ""
    models: tuple[str, ...] = ()

    @property
    def anchor(self) -> str:
        """Its name for files and links, e.g. "figure-8"."""
        return self.figure.lower().replace(" ", "-")


class ExpectedExhibit(_Part):
    """A figure that a command of cembench adds to a run."""

    figure: str
    shows: str
    command: str


class PrintedFigure(_Part):
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


class PrintedTable(_Part):
    """A table that shows its printed figures beside measured ones."""

    title: str
    caption: str = ""
    notes: tuple[str, ...] = ()
    figures: tuple[PrintedFigure, ...] = ()
    #: Whether it depends on the linear-algebra policy; then each policy has one.
    by_policy: bool = False
    #: Whether it compares the other algorithms with the reference; then it ends with averages.
    compares: bool = False


class Erratum(_Part):
    """A printed cell that contradicts the rest of the paper."""

    table: int
    model: str
    column: str
    reason: str


class HowRun(_Part):
    """A parameter with which the paper ran an algorithm on its own models, and elsewhere's value.

    Without `models` it is all of them.
    """

    algorithm: str
    parameter: str
    printed: Any
    elsewhere: Any
    models: tuple[str, ...] = ()


class StatedClaim(_Part):
    """A sentence of the paper with its test.

    That is an expression (:mod:`cembench.results.frame`), which `holds` for the maps of a surface
    by `algorithms`, or a `check`, which is ``module:function`` of the folder.
    """

    name: str
    quote: str
    place: str
    test: str
    check: str = ""
    holds: str = ""
    algorithms: tuple[str, ...] = ()
    remark: str = ""


class Paper(_Part):
    """A paper: what it printed, how it ran its algorithms, and what it claims."""

    #: The folder, and the package that it is if it is installed.
    folder: Path = Path()
    package: str = ""
    title: str
    authors: str
    place: str
    doi: str
    #: Under their names in cembench, in the order of the columns.
    algorithms: tuple[str, ...]
    #: The one that the others are compared with.
    reference: str
    #: What it was measured on.
    machine: str = ""
    profiles: ProfileLimits = ProfileLimits()
    #: Averages in its text, by what is averaged and by algorithm.
    stated: Mapping[str, Mapping[str, float]] = {}
    pictures: tuple[Picture, ...] = ()
    plots: Mapping[str, PlottedFigure] = {}
    exhibits: tuple[ExpectedExhibit, ...] = ()
    #: The printed tables with their misprints, by number, model and column.
    tables: Mapping[int, Mapping[str, Row]] = {}
    printed: Mapping[int, PrintedTable] = {}
    errata: tuple[Erratum, ...] = ()
    runs: tuple[HowRun, ...] = ()
    claims: tuple[StatedClaim, ...] = ()

    @property
    def citation(self) -> Citation:
        """Where it was published."""
        return Citation(self.title, self.authors, self.place, self.doi)

    @property
    def compared(self) -> tuple[str, ...]:
        """The algorithms that the reference is compared with."""
        return tuple(a for a in self.algorithms if a != self.reference)

    @property
    def models(self) -> tuple[str, ...]:
        """The models of the tables, in the paper's order."""
        return tuple(dict.fromkeys(model for rows in self.tables.values() for model in rows))

    def table_of(self, column: str) -> int | None:
        """Return the number of the printed table with this column of the frame, if any."""
        return next(
            (n for n, table in self.printed.items() if column in {f.column for f in table.figures}),
            None,
        )

    @property
    def misprints(self) -> Mapping[tuple[int, str, str], str]:
        """The reason for each misprinted cell, by table, model and column."""
        return {(one.table, one.model, one.column): one.reason for one in self.errata}

    def count(self, model: str, what: Literal["vertices", "faces"]) -> int:
        """Return the number of vertices or triangles of a model; 0 if no table has it."""
        found = (rows.get(model, {}).get(what) for rows in self.tables.values())
        return int(next((number for number in found if number is not None), 0))

    def faces(self, model: str) -> int:
        """Return the number of triangles of a model."""
        return self.count(model, "faces")

    def plotted(self, plot: str) -> PlottedFigure:
        """Return the figure that is plotted in this way; an empty one if there is none."""
        return self.plots.get(plot, PlottedFigure())

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

    def check(self, claim: StatedClaim) -> Callable[..., Any]:
        """Return the function that tests a claim.

        Raises
        ------
        RegistryError
            There is no such function, or its module cannot be imported.

        """
        module, _, name = claim.check.partition(":")
        where = f"{self.folder / 'claims.toml'}: claim {claim.name!r}: check {claim.check!r}"
        try:
            package = self.package or _package_of(self.folder)
            loaded = importlib.import_module(f"{package}.{module}")
        except Exception as error:
            raise RegistryError(
                f"{where}: module {module!r} cannot be imported: {describe_error(error)}. Repair "
                f"{self.folder / module}.py, or name another."
            ) from error
        found = getattr(loaded, name, None)
        if not callable(found):
            raise RegistryError(
                f"{where}: {module}.py has no function {name!r}; a check is module:function. "
                "Define it, or name another."
            )
        call: Callable[..., Any] = found
        return call


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
    about = _read_toml(folder / "paper.toml")
    listed = _read_toml(folder / "tables.toml")
    claimed = _read_toml(folder / "claims.toml", optional=True)
    words = {"machine": about.get("machine", "")}
    printed, tables = {}, {}
    for entry in _spelled_out(folder / "tables.toml", listed, "tables", words):
        number, file = entry.pop("number", None), entry.pop("file", None)
        if not isinstance(number, int) or not isinstance(file, str):
            raise _wrong(folder / "tables.toml", "tables", "needs a number and the name of a file")
        if number in tables:
            raise _wrong(folder / "tables.toml", "tables", f"table {number} occurs twice")
        printed[number], tables[number] = entry, _read_table(folder / file)
    parts = {
        **about,
        "tables": tables,
        "printed": printed,
        "errata": listed.get("errata", ()),
        "plots": _read_toml(folder / "figures.toml", optional=True),
        "runs": _read_toml(folder / "runs.toml", optional=True).get("runs", ()),
        "claims": _spelled_out(folder / "claims.toml", claimed, "claims", words),
        "folder": folder,
        "package": package,
    }
    try:
        paper = Paper.model_validate(parts)
    except ValidationError as error:
        first, *place = error.errors()[0]["loc"]
        file = folder / _FILES.get(str(first), "paper.toml")
        what = error.errors()[0]["msg"].lower()
        known = [name for name in Paper.model_fields if name not in ("folder", "package", *_FILES)]
        allowed = "" if place or first in _FILES else f"; allowed are {', '.join(known)}"
        raise _wrong(file, ".".join(map(str, (first, *place))), what + allowed) from error
    _check(paper)
    return paper


def _check(paper: Paper) -> None:
    """Raise if one part of a paper names what another does not have."""
    if paper.reference not in paper.algorithms:
        known = ", ".join(paper.algorithms)
        what = f"{paper.reference!r} is none of the paper's algorithms ({known})"
        raise _wrong(paper.folder / "paper.toml", "reference", what)
    for number, model, column in paper.misprints:
        if column not in paper.tables.get(number, {}).get(model, {}):
            what = f"table {number} has no cell {column!r} of {model!r}"
            raise _wrong(paper.folder / "tables.toml", "errata", what)
    named = [picture.model for picture in paper.pictures]
    named += [model for one in paper.plots.values() for model in one.models]
    named += [model for one in paper.runs for model in one.models]
    for model in named:
        if model not in paper.models:
            what = f"no printed table has it; known: {', '.join(paper.models)}"
            raise _wrong(paper.folder, f"model {model!r}", what)
    for model in paper.models:
        if not paper.faces(model):
            what = f"no table has the column 'faces' for {model!r}"
            raise _wrong(paper.folder / "tables.toml", "tables", what)
    names = [claim.name for claim in paper.claims]
    for claim in paper.claims:
        where = f"claim {claim.name!r}"
        if names.count(claim.name) > 1:
            raise _wrong(paper.folder / "claims.toml", where, "occurs twice")
        if bool(claim.holds) == bool(claim.check) or bool(claim.holds) != bool(claim.algorithms):
            what = 'it needs either "check", or "holds" and "algorithms"'
            raise _wrong(paper.folder / "claims.toml", where, what)
        if claim.check and not all(claim.check.partition(":")):
            what = f"check {claim.check!r} is not module:function"
            raise _wrong(paper.folder / "claims.toml", where, what)


def _wrong(file: Path, where: str, what: str) -> RegistryError:
    return RegistryError(f"{file}: {where}: {what}. {REMEDY}")


def _read_text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise RegistryError(f"{file} of a paper cannot be read: {why}. {REMEDY}") from error


def _read_toml(file: Path, *, optional: bool = False) -> dict[str, Any]:
    if optional and not file.exists():
        return {}
    try:
        return tomllib.loads(_read_text(file))
    except tomllib.TOMLDecodeError as error:
        raise RegistryError(f"{file} is not TOML: {error}. {REMEDY}") from error


def _entries(file: Path, read: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """Return the tables ``[[name]]`` of a file."""
    found = read.get(name, [])
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise _wrong(file, name, f"write each as a table [[{name}]]")
    return found


def _read_table(file: Path) -> dict[str, dict[str, str | None]]:
    """Return the rows of a CSV file by its first column; empty cells are None."""
    lines = list(csv.reader(_read_text(file).splitlines()))
    header, *rows = lines or [[]]
    found: dict[str, dict[str, str | None]] = {}
    for k, row in enumerate(rows, 2):
        if len(row) != len(header):
            raise _wrong(file, f"line {k}", f"{len(row)} cells, under {len(header)} headings")
        if row[0] in found:
            raise _wrong(file, f"line {k}", f"the model {row[0]!r} occurs twice")
        cells = zip(header[1:], row[1:], strict=True)
        found[row[0]] = {column: cell or None for column, cell in cells}
    return found


def _spelled_out(
    file: Path, read: Mapping[str, Any], name: str, words: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return the tables ``[[name]]`` of a file with words in place of their names in braces.

    The words are those given, and the file's ``[words]``.
    """
    words = {**words, **read.get("words", {})}
    try:
        return [
            {key: text.format_map(words) if isinstance(text, str) else text
             for key, text in one.items()}
            for one in _entries(file, read, name)
        ]  # fmt: skip
    except (LookupError, ValueError) as error:
        known = ", ".join(words) or "none"
        what = f"{{{error}}} is no word of [words]; known: {known}"
        raise _wrong(file, name, what) from error


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


def find_paper(named: str) -> Paper:
    """Return the installed paper of this name, or the one in this folder.

    Raises
    ------
    RegistryError
        There is neither, or the folder holds no paper.

    """
    if named in papers():
        return papers()[named]
    if not Path(named).is_dir():
        known = ", ".join(papers()) or "none"
        raise RegistryError(
            f"{named!r} is neither an installed paper nor a folder; installed: {known}. Name one "
            "of them, or a folder with a paper.toml."
        )
    return read_paper(Path(named))


def usual_paper() -> Paper:
    """Return the paper that profiles and reports are of where no other is named."""
    return next(iter(papers().values()), NO_PAPER)


def paper_of(model: str) -> Paper:
    """Return the first paper that has this model in its tables; without one, an empty paper."""
    return next((paper for paper in papers().values() if model in paper.models), NO_PAPER)
