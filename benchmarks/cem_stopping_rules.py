"""The stop of Algorithm 1: which reading meets the most figures that the paper prints."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import get_args

from cembench.algorithms.cem import cem

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from benchmarks.paper_models import CEM_PAPER, FOLDED, cells, models, printed
from cembench.conformal.boundary_iteration import Stop
from cembench.mesh.triangle_mesh import DiskMesh

#: The stops, and whether the best iterate is the result or the last one.
READINGS = {
    f"{stop}, {'best' if best else 'last'}": (stop, best)
    for stop, best in product(get_args(Stop), (False, True))
}
#: E_C, mean and SD of the angular distortion, and the number of iterations, as printed.
Figures = tuple[str, ...]
ABOUT = f"""\
The paper does not say when the iteration ends, except after 20 steps at most, nor which iterate is
the result. Each cell has E_C, mean, SD and the iterations of the map, and how many of these four
agree with the printed ones. `stop=drop` ends after the first step that does not lower E_C by 1e-5,
`stop=change` after the first that changes it by less; `best` is the iterate of least E_C. Folds are
not repaired on {FOLDED} (`repair=false`)."""
LAYOUT = f"""
| model | printed | {" | ".join(READINGS)} |
|---|---|{"---|" * len(READINGS)}
| {{model}} | {{printed}} | {" | ".join(f"{{cells[{name}]}}" for name in READINGS)} |"""


def cem_stopping_rules(folder: Path) -> Section:
    """Compare readings of the paper's stop with the figures that it prints.

    The paper does not state when the iteration stops, except after 20 steps at most, nor whether
    its last or its best iterate is the result. Measures the seven public models in a folder
    (`cembench fetch --group paper` prints one).
    """
    meshes = models(folder)
    rows, agreeing = [], dict.fromkeys(READINGS, 0)
    for model in progress(meshes):
        said = in_print(model)
        shown = {}
        for name, (stop, best) in READINGS.items():
            figures = measured(model, meshes[model], stop, best=best)
            count = sum(a == b for a, b in zip(said, figures, strict=True))
            agreeing[name] += count
            shown[name] = f"{' '.join(figures)} ({count})"
        rows.append({"model": model, "printed": " ".join(said), "cells": shown})
    rows.append({"model": f"agreeing, of {4 * len(meshes)}", "printed": "", "cells": agreeing})
    return Section([ABOUT, Table(rows, LAYOUT)], "docs/paper_models.md")


def in_print(model: str) -> Figures:
    """Return the figures that the paper prints for CEM."""
    return (*printed(model, "cem"), f"{CEM_PAPER.tables[1][model]['cem_iterations']:.0f}")


def measured(model: str, mesh: DiskMesh, stop: Stop, *, best: bool) -> Figures:
    """Return the figures of CEM with this stop and result."""
    figures = cells(mesh, cem(mesh.fresh(), stop=stop, best=best, repair=model != FOLDED))
    return (*figures.shown(), str(figures.iterations))
