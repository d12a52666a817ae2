"""The paper's seven public models: printed beside measured, and what numbering alone decides.

Fills docs/paper_models.md, and the short table of README.md, from the models in a folder
(`cembench fetch --group paper` prints one), known by their meshes whatever their files are called,
and from other coarse disks there::

    python -m benchmarks.paper_models FOLDER_OF_MESHES
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from cembench.algorithms.cem import cem, map_from_triangle
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import farthest_from_mean, ldm, map_numbered
from cembench.algorithms.qiem import qiem

from benchmarks.pages import ROOT, fill
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed, MeshError
from cembench.core.parameterization import Parameterization
from cembench.mesh.files import is_named_like_a_mesh, read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.results.papers import find_paper
from cembench.running.plan import paper_role_of

CEM_PAPER = find_paper("cem")
PAGE = ROOT / "docs/paper_models.md"
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


def cells(mesh: DiskMesh, found: Parameterization) -> Cells:
    """Return the figures of a map."""
    metrics = all_metrics(mesh, found.uv)
    return Cells(
        metrics["conformal_energy"],
        metrics["angle_error_mean_deg"],
        metrics["angle_error_sd_deg"],
        found.iterations,
        metrics["flipped_triangles"],
    )


def models(folder: Path) -> dict[str, DiskMesh]:
    """Return the paper's models among the files of a folder, in the paper's order."""
    registry, found = load_registry(), {}
    for path in sorted(filter(is_named_like_a_mesh, folder.iterdir())):
        try:
            mesh = read_mesh(path)
        except MeshError:
            continue  # not a disk, and every model is one
        if row := paper_role_of(registry, mesh).paper_row:
            found[row] = mesh
    rows = {dataset.paper_row for dataset in registry.datasets.values() if dataset.paper_row}
    if missing := rows - found.keys():
        raise SystemExit(
            f"{folder} lacks {', '.join(sorted(missing))}: cembench fetch --group paper"
        )
    return {row: found[row] for row in CEM_PAPER.models if row in found}


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
#: Other readings: the corrected FDM, and CEM with its own stop.
READINGS: tuple[tuple[str, str, Call], ...] = (
    ("fdm", "FDM, corrected", lambda mesh, model, repair: fdm(mesh, repair=repair)),
    ("cem", "CEM, its own stop", lambda mesh, model, repair: cem(mesh, repair=repair)),
)


@dataclass(frozen=True)
class Row:
    """One algorithm on one model: the three printed figures and those measured."""

    model: str
    column: str
    title: str
    said: tuple[str, str, str]
    found: Cells

    @property
    def agreeing(self) -> int:
        """How many of the three figures agree to the printed digits."""
        return sum(a == b for a, b in zip(self.said, self.found.shown(), strict=True))


def measured(
    meshes: Mapping[str, DiskMesh], runs: Sequence[tuple[str, str, Call]], *, repair: bool = False
) -> list[Row]:
    """Return what every call finds on every model."""
    rows = []
    for model, mesh in meshes.items():
        for column, title, call in runs:
            found = cells(mesh, call(mesh.fresh(), model, repair))
            rows.append(Row(model, column, title, printed(model, column), found))
            print(model, title, flush=True)
    return rows


def beside(rows: Sequence[Row]) -> Iterable[str]:
    """Yield the lines of the table of printed beside measured figures."""
    yield "| model | algorithm | printed E_C | mean | SD | here E_C | mean | SD | folds | digits |"
    yield "|---|---|---:|---:|---:|---:|---:|---:|---:|---|"
    for row in rows:
        pairs = zip(("E_C", "mean", "SD"), row.said, row.found.shown(), strict=True)
        differ = [name for name, a, b in pairs if a != b]
        agreed = "all agree" if not differ else f"not {', '.join(differ)}"
        yield (
            f"| {row.model} | {row.title} | {' | '.join(row.said)} "
            f"| {' | '.join(row.found.shown())} | {row.found.folds} | {agreed} |"
        )


def counted(rows: Sequence[Row]) -> str:
    """Return how many of the printed cells agree, by algorithm."""
    total = sum(row.agreeing for row in rows)
    by_title: dict[str, list[Row]] = {}
    for row in rows:
        by_title.setdefault(row.title, []).append(row)
    each = "; ".join(
        f"{title} {sum(row.agreeing for row in of)} of {3 * len(of)}"
        for title, of in by_title.items()
    )
    angles = sum(row.said[1:] == row.found.shown()[1:] for row in by_title["FDM"])
    return (
        f"{total} of {3 * len(rows)} cells agree to the printed digits: {each}. FDM's mean and SD "
        f"agree on {angles} of {len(by_title['FDM'])} models."
    )


def short(rows: Sequence[Row]) -> Iterable[str]:
    """Yield the lines of a table by model: measured, and printed in brackets where it differs."""
    titles = [title for _, title, _ in AS_PRINTED]
    yield f"| E_C, mean, SD | {' | '.join(titles)} |"
    yield f"|---|{'---|' * len(titles)}"
    for model in dict.fromkeys(row.model for row in rows):
        shown = {row.title: brackets(row) for row in rows if row.model == model}
        yield f"| {model} | {' | '.join(shown[title] for title in titles)} |"


def brackets(row: Row) -> str:
    """Return the measured figures, each with the printed one in brackets where that differs."""
    pairs = zip(row.said, row.found.shown(), strict=True)
    return ", ".join(here if here == said else f"{here} ({said})" for said, here in pairs)


def ldm_choices(mesh: DiskMesh) -> list[Cells]:
    """Return LDM's figures for every first boundary vertex, from the first copy, then the other."""
    return [*ldm_from(mesh, mirrored=False), *ldm_from(mesh, mirrored=True)]


def ldm_from(mesh: DiskMesh, *, mirrored: bool) -> list[Cells]:
    """Return LDM's figures for every first boundary vertex, the triangle from one copy."""
    found = []
    for first in range(len(mesh.boundary)):
        try:
            found.append(cells(mesh, map_numbered(mesh.fresh(), first, mirrored=mirrored)))
        except AlgorithmFailed:
            continue
    return found


def cem_choices(mesh: DiskMesh) -> list[Cells]:
    """Return CEM's figures for the start's triangle, all of them or `MOST` at even steps."""
    found = []
    for triangle in np.unique(np.linspace(0, mesh.m - 1, MOST).astype(int)):
        try:
            found.append(cells(mesh, map_from_triangle(mesh.fresh(), int(triangle))))
        except AlgorithmFailed:
            continue
    return found


def ranges(folder: Path) -> Iterable[str]:
    """Yield the lines of the table of what numbering decides."""
    yield "| surface | triangles | algorithm | choices | here | smallest E_C | median | largest |"
    yield "|---|---:|---|---:|---|---|---|---|"
    for file in COARSE:
        mesh = read_mesh(folder / file)
        usual: Mapping[str, tuple[Cells, list[Cells]]] = {
            "LDM, first vertex and copy": (cells(mesh, ldm(mesh.fresh())), ldm_choices(mesh)),
            "CEM, start triangle": (cells(mesh, cem(mesh.fresh())), cem_choices(mesh)),
        }
        for name, (here, found) in usual.items():
            ordered = sorted(found, key=lambda one: one.energy)
            three = (ordered[0], ordered[len(ordered) // 2], ordered[-1])
            shown = " | ".join(" ".join(one.shown()) for one in (here, *three))
            yield f"| {file} | {mesh.m:,} | {name} | {len(found)} | {shown} |"
            print(file, name, flush=True)


def nefertiti(mesh: DiskMesh) -> str:
    """Return what the choices on Nefertiti say of the printed cell of LDM."""
    found = ldm_choices(mesh)
    said = printed("Nefertiti", "ldm")
    lowest = int(np.argmin(mesh.boundary))
    first, mirrored = (
        " ".join(cells(mesh, map_numbered(mesh.fresh(), lowest, mirrored=copy)).shown())
        for copy in (False, True)
    )
    spans = [
        f"{min(one.energy for one in half):.4f} to {max(one.energy for one in half):.4f}"
        for half in (found[: len(found) // 2], found[len(found) // 2 :])
    ]
    near = [one for one in found if one.shown()[1:] == said[1:]]
    energies = sorted({one.shown()[0] for one in near})
    return (
        f"LDM on Nefertiti is printed {' '.join(said)}. Over {len(found)} choices E_C runs from "
        f"{spans[0]} with the triangle of the first copy, and from {spans[1]} with that of the "
        f"mirror copy; {len(near)} of them give the printed mean and SD, with E_C "
        f"{', '.join(energies)}. The lowest-numbered vertex gives {first}, or {mirrored} from the "
        f"mirror copy; the vertex farthest from the middle, which `ldm` takes (number "
        f"{farthest_from_mean(mesh)} of the loop), "
        f"{' '.join(cells(mesh, ldm(mesh.fresh())).shown())}. Each cell of the table is E_C, mean "
        "and SD."
    )


def main() -> None:
    """Measure, and fill the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    meshes = models(folder)
    rows = measured(meshes, AS_PRINTED)
    repaired = measured({FOLDED: meshes[FOLDED]}, AS_PRINTED, repair=True)
    fill(ROOT / "README.md", "paper_models", "\n".join(short(rows)))
    parts = ["## Printed beside measured", "", counted(rows), "", *beside(rows), ""]
    parts += ["Two other readings:", "", *beside(measured(meshes, READINGS)), ""]
    parts += [f"{FOLDED} with its folds repaired, the default:", "", *beside(repaired), ""]
    parts += ["## What numbering decides", "", nefertiti(meshes["Nefertiti"]), ""]
    fill(PAGE, "paper_models", "\n".join([*parts, *ranges(folder)]))


if __name__ == "__main__":
    main()
