"""Exhibits: pictures and tables of a run that are not cells.

Examples are the steps of Koebe's method, a morph, or a test of the theory. A command writes them to
``exhibits/NAME/`` in the run's folder, and the report shows them.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, model_validator

from cembench.core.atomic import read_model, unwritable, write_bytes, write_model
from cembench.core.errors import RecordError
from cembench.core.loading import check_no_link, files_in, is_there, read_bytes
from cembench.core.names import file_name
from cembench.results import run_folder
from cembench.results.records import MeshOrigin, Printable

FOLDER = "exhibits"
_DESCRIPTION = "exhibit.json"


class ExhibitPicture(BaseModel):
    """A picture of an exhibit: a file in the exhibit's folder."""

    model_config = ConfigDict(frozen=True)

    file: str
    caption: str
    #: Text for readers who cannot see the picture.
    alternative: str = ""


class ExhibitTable(BaseModel):
    """A table of an exhibit; None is an empty cell."""

    model_config = ConfigDict(frozen=True)

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]
    notes: tuple[str, ...] = ()
    #: Formats of the columns' numbers, by title; default: six digits that count.
    forms: dict[str, str] = {}
    #: Columns that a terminal leaves out where it is too narrow.
    details: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        declared: Mapping[str, Any],
        rows: Iterable[Mapping[str, Any]],
        **more: Any,
    ) -> Self:
        """Return a table of rows by key; the `columns` declared are the headings of the keys."""
        headings = declared["columns"]
        held = tuple(tuple(row.get(key) for key in headings) for row in rows)
        table = {**declared, "columns": tuple(headings.values()), "rows": held, **more}
        return cls.model_validate(table)

    @model_validator(mode="after")
    def _rows_fit(self) -> Self:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"a row does not have {len(self.columns)} values, one for each column")
        return self


class Exhibit(BaseModel):
    """Pictures and tables that a report shows in their own section.

    `figure` is the paper's figure that it reproduces, if any; `origin` names the
    surface; `command` makes it again; `facts` are figures by name, as the command's ``--json``
    prints them.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    title: str
    text: str
    command: Printable
    origin: MeshOrigin
    figure: str = ""
    pictures: tuple[ExhibitPicture, ...] = ()
    tables: tuple[ExhibitTable, ...] = ()
    facts: dict[str, Any] = {}


def command(verb: str, surface: Any, mesh_name: str, **settings: float | str | None) -> str:
    """Return the command line that makes an exhibit of a surface again.

    A surface that is no path goes by the name of its mesh.
    """
    name = Path(surface).name if isinstance(surface, str | os.PathLike) else mesh_name
    options = [f"--{name} {value}" for name, value in settings.items() if value is not None]
    return " ".join(["cembench", verb, name, *options])


def exhibit_folder(run: Path, name: str) -> Path:
    """Return the folder of an exhibit; it and the run's folder are made if necessary.

    Raises
    ------
    RecordError
        The folder `run` is not a run and not empty, or cannot be written to, or a link is in the
        exhibit's place.
    """
    run_folder.claim(run)
    folder = place_of(run, name)
    check_no_link(folder, run)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error) from error
    return folder


def place_of(run: Path, name: str, file: str = "") -> Path:
    """Return the path of an exhibit or of one of its files; never outside the run."""
    folder = run / FOLDER / file_name(name)
    return folder / file_name(file) if file else folder


def write_exhibit(run: Path, exhibit: Exhibit) -> Path:
    """Write the description of an exhibit whose pictures are in its folder; return its path.

    Raises
    ------
    RecordError
        A picture that it names does not exist.
    """
    folder = exhibit_folder(run, exhibit.name)
    for picture in exhibit.pictures:
        if not (folder / picture.file).is_file():
            raise RecordError(
                f"exhibit {exhibit.name!r}: there is no picture {folder / picture.file}."
            )
    path = folder / _DESCRIPTION
    write_model(path, exhibit)
    return path


def read_exhibits(run: Path) -> list[Exhibit]:
    """Return the exhibits of a run, sorted by name.

    Raises
    ------
    RecordError
        A description cannot be read, or a link leads to it.
    """
    described = [folder / _DESCRIPTION for folder in files_in(run / FOLDER, "*", run)]
    return [read_model(path, Exhibit, run) for path in described if is_there(path)]


def copy_exhibits(run: Path, into: Path) -> None:
    """Copy the exhibits of a run, with their pictures, to another that does not have them.

    Where it has a different exhibit of that name, the copy is numbered; tables of the same columns
    without pictures, as the lists of the surfaces of two runs, become one.

    Raises
    ------
    RecordError
        A description or a picture cannot be read or written, or a link is in its place.
    """
    held = {one.name: one for one in read_exhibits(into)}
    for exhibit in read_exhibits(run):
        there, copy, number = held.get(exhibit.name, exhibit), exhibit, 1
        if there != exhibit and (both := _joined(there, exhibit)):
            held[exhibit.name] = both
            write_model(place_of(into, exhibit.name) / _DESCRIPTION, both)
            continue
        while copy.name in held and held[copy.name] != copy:
            number += 1
            names = {"name": f"{exhibit.name}-{number}", "title": f"{exhibit.title} ({number})"}
            copy = exhibit.model_copy(update=names)
        if copy.name in held:
            continue
        folder = exhibit_folder(into, copy.name)
        for picture in exhibit.pictures:
            file = place_of(run, exhibit.name, picture.file)
            if is_there(file):  # else a report names it as gone
                write_bytes(place_of(into, copy.name, picture.file), read_bytes(file, run))
        write_model(folder / _DESCRIPTION, copy)
        held[copy.name] = copy


def _joined(one: Exhibit, other: Exhibit) -> Exhibit | None:
    """Return two exhibits as one if they are tables of the same columns, and nothing else."""
    kinds = [(x.title, x.origin, *((t.title, t.columns) for t in x.tables)) for x in (one, other)]
    if kinds[0] != kinds[1] or one.pictures or other.pictures or not one.tables:
        return None

    def union(*parts: Iterable[Any]) -> Any:
        return tuple(dict.fromkeys(chain(*parts)))

    tables = tuple(
        a.model_copy(update={"rows": union(a.rows, b.rows), "notes": union(a.notes, b.notes)})
        for a, b in zip(one.tables, other.tables, strict=True)
    )
    text = "\n\n".join(union(one.text.split("\n\n"), other.text.split("\n\n")))
    made = "; ".join(union(one.command.split("; "), other.command.split("; ")))
    return one.model_copy(update={"tables": tables, "text": text, "command": made, "facts": {}})
