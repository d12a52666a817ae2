"""Is a printed row of QIEM the map of a flow that had not converged?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cembench.algorithms import qiem as rules

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from benchmarks.paper_models import Cells, cells, models, printed
from benchmarks.qiem_picture import finished, remembering
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh

LAYOUT = """
| model | printed E_C, mean, SD | step | here | met | last step | here |
|---|---|---:|---|---|---:|---|
| {model} | {printed} | {step} | {here} | {met} | {last} | {converged} |"""
NAMES = ("E_C", "mean", "SD")


def iterates(mesh: DiskMesh) -> list[Cells]:
    """Return the figures of the map after each step of QIEM's flow, without repair of folds."""
    with remembering() as tried:
        rules.qiem(mesh.fresh(), repair=False)
    return [cells(mesh, Parameterization(z)) for z in finished(mesh, tried) if z is not None]


def row(model: str, mesh: DiskMesh) -> dict[str, Any]:
    """Fit the number of steps to a printed row: the step that is nearest in E_C."""
    said, steps = printed(model, "qiem"), iterates(mesh)
    step = int(np.argmin([abs(one.energy - float(said[0])) for one in steps]))
    shown = steps[step].shown()
    met = [name for name, a, b in zip(NAMES, said, shown, strict=True) if a == b]
    return {
        "model": model,
        "printed": " ".join(said),
        "step": step + 1,
        "here": " ".join(shown),
        "met": ", ".join(met) or "none",
        "last": len(steps),
        "converged": " ".join(steps[-1].shown()),
    }


def qiem_iterates(folder: Path) -> Section:
    """Fit the number of QIEM's steps to each printed row, one integer a row.

    The models are in a folder (`cembench fetch --group paper` prints one), known by their meshes.
    Each step is laid out as at the flow's end: boundary on the circle, interior solved for.
    """
    rows = [row(model, mesh) for model, mesh in progress(list(models(folder).items()))]
    return Section([Table(rows, LAYOUT)], "docs/papers.md")
