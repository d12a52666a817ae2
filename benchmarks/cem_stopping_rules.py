"""Compare CEM's two readings of its stopping rule. Fills the table of docs/algorithms.md.

The paper does not state when its iteration stops, except after 20 iterations at most. Both readings
take the same steps; they differ in how many::

    python -m benchmarks.cem_stopping_rules --meshes ../meshes
    python -m benchmarks.cem_stopping_rules --most-faces 100000
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from cembench.algorithms.cem import cem
from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.rows import ROWS

from benchmarks.pages import fill
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from cembench.mesh.reading import is_named_like_a_mesh
from cembench.mesh.triangle_mesh import DiskMesh

PAGE = Path(__file__).parents[1] / "docs/algorithms.md"
TOLERANCE = 1e-5


def main() -> None:
    """Measure, and write the table into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--meshes", type=Path, help="folder of real disks; they are marked *")
    parser.add_argument("--most-faces", type=int, default=10**9, help="leave larger stand-ins out")
    chosen = parser.parse_args()
    lines = []
    for name, mesh in surfaces(chosen.meshes, chosen.most_faces):
        lines.append((mesh.m, line(name, mesh)))
        print(lines[-1][1], flush=True)
    table = "\n".join(text for _, text in sorted(lines))
    fill(PAGE, "cem_stopping_rules", f"{HEADING}\n{table}")


HEADING = """\
| surface | triangles | old: iterations | E_C | mean | new: iterations | E_C | mean | least E_C at |
|---|---:|---:|---:|---:|---:|---:|---:|---:|"""


def surfaces(folder: Path | None, most_faces: int) -> Iterator[tuple[str, DiskMesh]]:
    """The stand-ins up to a size, and the meshes of a folder, marked with a star."""
    for path in sorted(folder.iterdir()) if folder else ():
        if is_named_like_a_mesh(path):
            yield f"{path.name}*", read_mesh(path)
    for name, row in ROWS.items():
        if row.faces <= most_faces:
            yield name, stand_in(name)


def line(name: str, mesh: DiskMesh) -> str:
    """The table's row of one surface."""
    history = cem(mesh.fresh(), tolerance=TOLERANCE).energy_history
    least = min(range(len(history)), key=history.__getitem__)
    cells = [figures(mesh, count) for count in (old_rule(history), len(history) - 1)]
    return f"| {name} | {mesh.m:,} | {' | '.join(cells)} | {least} |"


def old_rule(history: Sequence[float]) -> int:
    """Return after how many iterations the first one lowers E_C by less than the tolerance."""
    falls = [before - after for before, after in pairwise(history)]
    small = [k for k, fall in enumerate(falls, start=1) if fall < TOLERANCE]
    return small[0] if small else len(falls)


def figures(mesh: DiskMesh, iterations: int) -> str:
    """Iterations, E_C and mean angle error of CEM after so many iterations."""
    found = all_metrics(mesh, cem(mesh.fresh(), tolerance=0, max_iterations=iterations).uv)
    energy, angle = found["conformal_energy"], found["angle_error_mean_deg"]
    return f"{iterations} | {energy:#.4g} | {angle:#.4g}"


if __name__ == "__main__":
    main()
