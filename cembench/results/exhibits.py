"""What else belongs to a run: pictures and tables that are no cell of it.

The steps of Koebe's method, a morph, an experiment on the theory: a verb makes them and lays them
into the run's folder, ``exhibits/NAME/``, and the report shows what lies there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, model_validator

from cembench.core.atomic import read_model, unwritable, write_model
from cembench.core.errors import RecordError
from cembench.core.loading import files_in, is_there
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
    #: What a reader who cannot see it should know.
    alternative: str = ""


class ExhibitTable(BaseModel):
    """A table of an exhibit; None is a gap."""

    model_config = ConfigDict(frozen=True)

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]
    notes: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _rows_fit(self) -> Self:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"a row has not {len(self.columns)} values, as there are columns")
        return self


class Exhibit(BaseModel):
    """Something that a report shows in a section of its own.

    `figure` is the paper's figure that it regenerates ("Figure 7"), if any; `origin` says on what
    it was made; `command` makes it again; `facts` are figures by name, as the verb's ``--json``
    gives them.
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


def exhibit_folder(run: Path, name: str) -> Path:
    """Where the files of an exhibit lie; made if need be, and the run's folder too.

    Raises
    ------
    RecordError
        The folder `run` is not a run and not empty, or cannot be written to.

    """
    run_folder.claim(run)
    folder = place_of(run, name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error) from error
    return folder


def place_of(run: Path, name: str, file: str = "") -> Path:
    """Where an exhibit of this name, or a file of it, would lie; never outside the run."""
    folder = run / FOLDER / file_name(name)
    return folder / file_name(file) if file else folder


def write_exhibit(run: Path, exhibit: Exhibit) -> Path:
    """Describe an exhibit whose pictures already lie in its folder; where is the description?

    Raises
    ------
    RecordError
        A picture that it names is not there.

    """
    folder = exhibit_folder(run, exhibit.name)
    for picture in exhibit.pictures:
        if not (folder / picture.file).is_file():
            raise RecordError(f"exhibit {exhibit.name!r}: there is no {folder / picture.file}.")
    path = folder / _DESCRIPTION
    write_model(path, exhibit)
    return path


def read_exhibits(run: Path) -> list[Exhibit]:
    """The exhibits of a run, by name; none for a run without any.

    Raises
    ------
    RecordError
        A description that cannot be read.

    """
    described = [folder / _DESCRIPTION for folder in files_in(run / FOLDER, "*")]
    return [read_model(path, Exhibit) for path in described if is_there(path)]
