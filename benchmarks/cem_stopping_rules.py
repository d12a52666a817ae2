"""The stop of Algorithm 1: which reading meets the most figures that the paper prints.

The paper does not state when the iteration stops, except after 20 steps at most, nor whether its
last or its best iterate is the result. Fills a table of docs/paper_models.md from the seven public
models in a folder (`cembench fetch --group paper` prints one)::

    python -m benchmarks.cem_stopping_rules FOLDER_OF_MESHES
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import get_args

from cembench.algorithms.cem import cem

from benchmarks.pages import fill
from benchmarks.paper_models import CEM_PAPER, FOLDED, PAGE, cells, models, printed
from cembench.conformal.boundary_iteration import Stop
from cembench.mesh.triangle_mesh import DiskMesh

#: The stops, and whether the best iterate is the result or the last one.
READINGS = tuple(product(get_args(Stop), (False, True)))
#: E_C, mean and SD of the angular distortion, and the number of iterations, as printed.
Figures = tuple[str, ...]

ABOUT = f"""\
The paper does not say when the iteration ends, except after 20 steps at most, nor which iterate is
the result. Each cell has E_C, mean, SD and the iterations of the map, and how many of these four
agree with the printed ones. `stop=drop` ends after the first step that does not lower E_C by 1e-5,
`stop=change` after the first that changes it by less; `best` is the iterate of least E_C. Folds are
not repaired on {FOLDED} (`repair=false`)."""


def main() -> None:
    """Measure, and write the table into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    table = "\n".join(lines(models(parser.parse_args().folder)))
    fill(PAGE, "cem_stopping_rules", f"{ABOUT}\n\n{table}")


def lines(meshes: dict[str, DiskMesh]) -> Iterator[str]:
    """Yield the lines of the table."""
    titles = [f"{stop}, {'best' if best else 'last'}" for stop, best in READINGS]
    yield f"| model | printed | {' | '.join(titles)} |"
    yield f"|---|---|{'---|' * len(titles)}"
    met = [0] * len(READINGS)
    for model, mesh in meshes.items():
        said = in_print(model)
        shown = []
        for k, (stop, best) in enumerate(READINGS):
            found = measured(model, mesh, stop, best=best)
            count = agreeing(said, found)
            met[k] += count
            shown.append(f"{' '.join(found)} ({count})")
        yield f"| {model} | {' '.join(said)} | {' | '.join(shown)} |"
    totals = " | ".join(map(str, met))
    yield f"| agreeing, of {4 * len(meshes)} | | {totals} |"


def in_print(model: str) -> Figures:
    """Return the figures that the paper prints for CEM."""
    return (*printed(model, "cem"), f"{CEM_PAPER.tables[1][model]['cem_iterations']:.0f}")


def measured(model: str, mesh: DiskMesh, stop: Stop, *, best: bool) -> Figures:
    """Return the figures of CEM with this stop and result."""
    found = cells(mesh, cem(mesh.fresh(), stop=stop, best=best, repair=model != FOLDED))
    return (*found.shown(), str(found.iterations))


def agreeing(said: Figures, found: Figures) -> int:
    """Return how many figures have the printed digits."""
    return sum(a == b for a, b in zip(said, found, strict=True))


if __name__ == "__main__":
    main()
