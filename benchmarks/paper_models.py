"""The paper's four public models: printed beside measured, and what numbering alone decides.

Fills docs/paper_models.md, and the short table of README.md, from the files of the models
(`cembench fetch --group paper`; Nefertiti comes with CGAL) and from other coarse disks::

    python -m benchmarks.paper_models FOLDER_OF_MESHES
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cembench.algorithms.cem import cem, map_from_triangle
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import farthest_from_mean, ldm, map_numbered
from cembench.algorithms.qiem import qiem

from benchmarks.pages import ROOT, fill
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.results import paper

PAGE = ROOT / "docs/paper_models.md"
MODELS = {
    "Nefertiti": "nefertiti.obj",
    "Chinese Lion": "chinese_lion.obj",
    "Human Brain": "human_brain.obj",
    "Left Hand": "left_hand.obj",
}
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
    )


def printed(model: str, algorithm: str) -> tuple[str, str, str]:
    """Return the paper's cells of Tables 3 and 4."""
    third, fourth = paper.table(3)[model], paper.table(4)[model]
    return (
        f"{third[algorithm]:.4f}",
        f"{fourth[f'{algorithm}_mean']:.2f}",
        f"{fourth[f'{algorithm}_sd']:.2f}",
    )


def cem_as_printed(mesh: DiskMesh, model: str) -> Parameterization:
    """CEM stopped after the number of iterations that Table 1 prints."""
    count = paper.table(1)[model]["cem_iterations"]
    assert count is not None
    return cem(mesh, max_iterations=int(count), tolerance=0)


#: What is measured: the paper's column, what it is called here, and the call.
RUNS: tuple[tuple[str, str, Callable[[DiskMesh, str], Parameterization]], ...] = (
    ("qiem", "QIEM", lambda mesh, model: qiem(mesh)),
    ("fdm", "FDM, public program", lambda mesh, model: fdm(mesh, public_program=True)),
    ("fdm", "FDM, corrected", lambda mesh, model: fdm(mesh)),
    ("ldm", "LDM", lambda mesh, model: ldm(mesh)),
    ("cem", "CEM, as many iterations", cem_as_printed),
    ("cem", "CEM, its own stop", lambda mesh, model: cem(mesh)),
)


@dataclass(frozen=True)
class Row:
    """One algorithm on one model: the three printed figures and those measured."""

    model: str
    column: str
    title: str
    said: tuple[str, str, str]
    found: tuple[str, str, str]


def measured(folder: Path) -> Iterable[Row]:
    """Yield what every call of :data:`RUNS` finds on every model."""
    for model, file in MODELS.items():
        mesh = read_mesh(folder / file)
        for column, title, call in RUNS:
            found = cells(mesh, call(mesh.fresh(), model)).shown()
            yield Row(model, column, title, printed(model, column), found)
            print(model, title, flush=True)


def beside(rows: Sequence[Row]) -> Iterable[str]:
    """Yield the lines of the table of printed beside measured figures."""
    yield "| model | algorithm | printed E_C | mean | SD | measured E_C | mean | SD | digits |"
    yield "|---|---|---:|---:|---:|---:|---:|---:|---|"
    for row in rows:
        differ = [
            name
            for name, a, b in zip(("E_C", "mean", "SD"), row.said, row.found, strict=True)
            if a != b
        ]
        agreed = "all agree" if not differ else f"not {', '.join(differ)}"
        yield (
            f"| {row.model} | {row.title} | {' | '.join(row.said)} | {' | '.join(row.found)} "
            f"| {agreed} |"
        )


#: What README.md shows of each of the paper's columns.
SHORT = {
    "QIEM": "QIEM",
    "FDM, public program": "FDM",
    "LDM": "LDM",
    "CEM, as many iterations": "CEM",
}


def short(rows: Sequence[Row]) -> Iterable[str]:
    """Yield the lines of a table by model: measured, and printed in brackets where it differs."""
    yield f"| E_C, mean, SD | {' | '.join(SHORT.values())} |"
    yield f"|---|{'---|' * len(SHORT)}"
    for model in MODELS:
        shown = {row.title: brackets(row) for row in rows if row.model == model}
        yield f"| {model} | {' | '.join(shown[title] for title in SHORT)} |"


def brackets(row: Row) -> str:
    """Return the measured figures, each with the printed one in brackets where that differs."""
    pairs = zip(row.said, row.found, strict=True)
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


def nefertiti(folder: Path) -> str:
    """Return what the choices on Nefertiti say of the printed cell of LDM."""
    mesh = read_mesh(folder / MODELS["Nefertiti"])
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
    rows = list(measured(folder))
    fill(ROOT / "README.md", "paper_models", "\n".join(short(rows)))
    parts = ["## Printed beside measured", "", *beside(rows), "", "## What numbering decides", ""]
    parts += [nefertiti(folder), "", *ranges(folder)]
    fill(PAGE, "paper_models", "\n".join(parts))


if __name__ == "__main__":
    main()
