"""The paper's seven public models: printed beside measured, and what numbering alone decides."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from cembench.algorithms.cem import cem, map_from_triangle
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import farthest_from_mean, ldm, map_numbered
from cembench.algorithms.qiem import qiem

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed, MeshError
from cembench.core.parameterization import Parameterization
from cembench.mesh.files import is_named_like_a_mesh, read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.results.papers import find_paper
from cembench.running.plan import provenance_of

CEM_PAPER = find_paper("cem")
#: The model whose maps fold by every method.
FOLDED = "David Head"
#: Coarse disks on which the numbering is studied besides, and how many choices are tried at most.
COARSE = ("nefertiti.obj", "canonical_face.obj", "hand_lowres.obj", "turtle.obj")
MOST = 600


@dataclass(frozen=True)
class Cells:
    """E_C, mean and SD of the angular distortion in degrees, and iterations if there are any."""

    energy: float
    mean: float
    sd: float
    iterations: int | None = None
    folds: int = 0

    def shown(self) -> tuple[str, str, str]:
        """The figures with the digits that the paper prints."""
        return f"{self.energy:.4f}", f"{self.mean:.2f}", f"{self.sd:.2f}"


def cells(mesh: DiskMesh, result: Parameterization) -> Cells:
    """Return the figures of a map."""
    metrics = all_metrics(mesh, result.uv)
    return Cells(
        metrics["conformal_energy"],
        metrics["angle_error_mean_deg"],
        metrics["angle_error_sd_deg"],
        result.iterations,
        metrics["flipped_triangles"],
    )


def models(folder: Path) -> dict[str, DiskMesh]:
    """Return the paper's models among the files of a folder, in the paper's order."""
    registry, meshes = load_registry(), {}
    for path in sorted(filter(is_named_like_a_mesh, folder.iterdir())):
        try:
            mesh = read_mesh(path)
        except MeshError:
            continue  # not a disk, and every model is one
        if row := provenance_of(registry, mesh).paper_row:
            meshes[row] = mesh
    rows = {dataset.paper_row for dataset in registry.datasets.values() if dataset.paper_row}
    if missing := rows - meshes.keys():
        raise SystemExit(
            f"{folder} lacks {', '.join(sorted(missing))}: cembench fetch --group paper"
        )
    return {row: meshes[row] for row in CEM_PAPER.models if row in meshes}


def printed(model: str, algorithm: str) -> tuple[str, str, str]:
    """Return the paper's cells of Tables 3 and 4."""
    third, fourth = CEM_PAPER.tables[3][model], CEM_PAPER.tables[4][model]
    return (
        f"{third[algorithm]:.4f}",
        f"{fourth[f'{algorithm}_mean']:.2f}",
        f"{fourth[f'{algorithm}_sd']:.2f}",
    )


def cem_as_printed(mesh: DiskMesh, model: str, *, repair: bool = False) -> Parameterization:
    """CEM stopped after the number of iterations that Table 1 prints."""
    count = CEM_PAPER.tables[1][model]["cem_iterations"]
    assert count is not None
    return cem(mesh, max_iterations=int(count), tolerance=0, stop="change", repair=repair)


Call: TypeAlias = Callable[..., Parameterization]
#: The paper's columns as it ran them: the column, what it is called here, and the call, which takes
#: the mesh, the model and whether folds are repaired.
AS_PRINTED: tuple[tuple[str, str, Call], ...] = (
    ("qiem", "QIEM", lambda mesh, model, repair: qiem(mesh, repair=repair)),
    ("fdm", "FDM", lambda mesh, model, repair: fdm(mesh, public_program=True, repair=repair)),
    ("ldm", "LDM", lambda mesh, model, repair: ldm(mesh, repair=repair)),
    ("cem", "CEM", lambda mesh, model, repair: cem_as_printed(mesh, model, repair=repair)),
)


BESIDE = """
| model | algorithm | printed E_C | mean | SD | here E_C | mean | SD | folds | digits |
|---|---|---:|---:|---:|---:|---:|---:|---:|---|
| {model} | {title} | {said[0]} | {said[1]} | {said[2]} | {here[0]} | {here[1]} | {here[2]} \
| {folds} | {digits} |"""
RANGES = """
| surface | triangles | algorithm | choices | here | smallest E_C | median | largest |
|---|---:|---|---:|---|---|---|---|
| {surface} | {faces:,} | {algorithm} | {choices} | {here} | {smallest} | {median} | {largest} |"""


def paper_models(folder: Path) -> list[Section]:
    """Measure the paper's seven public models, and what numbering alone decides.

    For docs/paper_models.md, from the models in a folder
    (`cembench fetch --group paper` prints one), known by their meshes whatever their files are
    called, and from other coarse disks there.
    """
    meshes = models(folder)
    rows = measured(meshes, AS_PRINTED)
    repaired = measured({FOLDED: meshes[FOLDED]}, AS_PRINTED, repair=True)
    parts = ["## Printed beside measured", counted(rows), Table(rows, BESIDE)]
    parts += [f"{FOLDED} with its folds repaired, the default:", Table(repaired, BESIDE)]
    parts += ["## What numbering decides", nefertiti(meshes["Nefertiti"])]
    parts += [Table(list(ranges(folder)), RANGES)]
    return [Section(parts, "docs/paper_models.md")]


def measured(
    meshes: Mapping[str, DiskMesh], runs: Sequence[tuple[str, str, Call]], *, repair: bool = False
) -> list[dict[str, Any]]:
    """Return the three printed figures and those of every call, on every model."""
    rows = []
    for model in progress(meshes):
        for column, title, call in runs:
            figures = cells(meshes[model], call(meshes[model].fresh(), model, repair))
            said, own = printed(model, column), figures.shown()
            names = zip(("E_C", "mean", "SD"), said, own, strict=True)
            differ = [name for name, a, b in names if a != b]
            digits = f"not {', '.join(differ)}" if differ else "all agree"
            rows.append({"model": model, "column": column, "title": title, "said": said,
                         "here": own, "folds": figures.folds, "digits": digits})  # fmt: skip
    return rows


def counted(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return how many of the printed cells agree, by algorithm."""
    agreeing: dict[str, list[tuple[bool, ...]]] = {}
    for row in rows:
        same = tuple(a == b for a, b in zip(row["said"], row["here"], strict=True))
        agreeing.setdefault(row["title"], []).append(same)
    counts = {title: sum(map(sum, of)) for title, of in agreeing.items()}
    each = "; ".join(f"{title} {n} of {3 * len(agreeing[title])}" for title, n in counts.items())
    angles = sum(all(same[1:]) for same in agreeing["FDM"])
    return (
        f"{sum(counts.values())} of {3 * len(rows)} cells agree to the printed digits: {each}. "
        f"FDM's mean and SD agree on {angles} of {len(agreeing['FDM'])} models."
    )


def ldm_choices(mesh: DiskMesh) -> list[Cells]:
    """Return LDM's figures for every first boundary vertex, from the first copy, then the other."""
    ways = ((first, copy) for copy in (False, True) for first in range(len(mesh.boundary)))
    return list(_maps(mesh, lambda disk, way: map_numbered(disk, way[0], mirrored=way[1]), ways))


def cem_choices(mesh: DiskMesh) -> list[Cells]:
    """Return CEM's figures for the start's triangle, all of them or `MOST` at even steps."""
    triangles = np.unique(np.linspace(0, mesh.m - 1, MOST).astype(int))
    return list(_maps(mesh, map_from_triangle, triangles.tolist()))


def _maps(mesh: DiskMesh, call: Callable[..., Parameterization], ways: Any) -> Iterator[Cells]:
    for way in ways:
        with suppress(AlgorithmFailed):
            yield cells(mesh, call(mesh.fresh(), way))


def ranges(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what numbering decides on each coarse disk."""
    for file in progress(COARSE):
        mesh = read_mesh(folder / file)
        for name, usual, choices in (
            ("LDM, first vertex and copy", ldm, ldm_choices),
            ("CEM, start triangle", cem, cem_choices),
        ):
            ordered = sorted(choices(mesh), key=lambda one: one.energy)
            four = {
                "here": cells(mesh, usual(mesh.fresh())),
                "smallest": ordered[0],
                "median": ordered[len(ordered) // 2],
                "largest": ordered[-1],
            }
            yield {
                "surface": file,
                "faces": mesh.m,
                "algorithm": name,
                "choices": len(ordered),
                **{key: " ".join(one.shown()) for key, one in four.items()},
            }


def nefertiti(mesh: DiskMesh) -> str:
    """Return what the choices on Nefertiti say of the printed cell of LDM."""
    choices = ldm_choices(mesh)
    said = printed("Nefertiti", "ldm")
    lowest = int(np.argmin(mesh.boundary))
    first, mirrored = (
        " ".join(cells(mesh, map_numbered(mesh.fresh(), lowest, mirrored=copy)).shown())
        for copy in (False, True)
    )
    spans = [
        f"{min(one.energy for one in half):.4f} to {max(one.energy for one in half):.4f}"
        for half in (choices[: len(choices) // 2], choices[len(choices) // 2 :])
    ]
    near = [one for one in choices if one.shown()[1:] == said[1:]]
    energies = sorted({one.shown()[0] for one in near})
    return (
        f"LDM on Nefertiti is printed {' '.join(said)}. Over {len(choices)} choices E_C runs from "
        f"{spans[0]} with the triangle of the first copy, and from {spans[1]} with that of the "
        f"mirror copy; {len(near)} of them give the printed mean and SD, with E_C "
        f"{', '.join(energies)}. The lowest-numbered vertex gives {first}, or {mirrored} from the "
        f"mirror copy; the vertex farthest from the middle, which `ldm` takes (number "
        f"{farthest_from_mean(mesh)} of the loop), "
        f"{' '.join(cells(mesh, ldm(mesh.fresh())).shown())}. Each cell of the table is E_C, mean "
        "and SD."
    )
