"""Real meshes that can be fetched: those in `real_meshes.tsv`, models of installed papers in their
`models.tsv`, and the ICT face model.
"""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from urllib.parse import quote

from cembench.core.errors import RegistryError, describe_error
from cembench.mesh.datasets import Dataset, Part
from cembench.results.papers import papers

from .ict_model import EXPRESSIONS, IDENTITIES, NEUTRAL, model_folder, read_small, small_arrays

#: The table of meshes that are no model of a paper.
OWN = Path(__file__).with_name("real_meshes.tsv")
_RAW = "https://raw.githubusercontent.com"
_ICT = f"{_RAW}/ICT-VGL/ICT-FaceKit/da5f95a607f5e6b37755b38d3385d7f2853732e5/FaceXModel"
#: Approximate bytes of one model file; all are text files with the same number of lines.
_ICT_SIZE = 2_558_000


def dataset_of(row: Mapping[str, str]) -> Dataset:
    """Return the dataset of a row of such a table; empty cells mean unknown."""
    first, _, last = row["polygons"].partition("-")
    vertices, _, triangles = row["arrays"].partition(",")
    return Dataset(
        row["name"],
        row["title"],
        f"{_RAW}/{row['repository']}/{row['commit']}/{quote(row['path'])}",
        sha256=row["sha256"],
        licence=row["licence"],
        size=int(row["bytes"]) if row["bytes"] else None,
        paper_row=row["paper_row"],
        mesh_hash=row["mesh_hash"],
        group=row["group"],
        faces=int(row["faces"]),
        arrays=(vertices, triangles) if triangles else None,
        polygons=(int(first), int(last)) if last else None,
        note="; ".join(filter(None, (f"terms: {row['terms']}", row["note"]))),
        source=row["repository"],
        family=row["family"],
    )


def read_datasets(file: Path) -> list[Dataset]:
    """Return the datasets of a table.

    Raises
    ------
    RegistryError
        A column or a cell is missing, or a number is none.
    """
    lines = file.read_text(encoding="utf-8").splitlines()
    try:
        return [dataset_of(row) for row in csv.DictReader(lines, delimiter="\t")]
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise RegistryError(
            f"{file} is no table of meshes: {describe_error(error)}. Give it the columns of "
            f"{OWN}, with a number of faces in each line."
        ) from error


def _real_meshes() -> tuple[Dataset, ...]:
    of_papers = (paper.folder / "models.tsv" for paper in papers().values())
    tables = (*(file for file in of_papers if file.is_file()), OWN)
    return tuple(dataset for file in tables for dataset in read_datasets(file))


def _ict_file(name: str) -> Dataset:
    """Return the dataset of one file of the ICT face model, which is kept as small arrays.

    Most of the checksums are not known here; a file must have the polygons of the model.
    """
    kept = partial(_ict_place, name)
    part = Part(kept, small_arrays, lambda path: read_small(path) is not None)
    url, group = f"{_ICT}/{name}.obj", "ict-face"
    return Dataset(f"ict-{name}", name, url, "", "MIT", size=_ICT_SIZE, group=group, part=part)


def _ict_place(name: str) -> Path:
    return model_folder() / f"{name}.npz"


REAL_MESHES = _real_meshes()
ICT_FACE = tuple(map(_ict_file, itertools.chain((NEUTRAL,), IDENTITIES, EXPRESSIONS)))
