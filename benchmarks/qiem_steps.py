"""How much do QIEM's own rules decide how it stands to CEM? A table for docs/algorithms.md.

The paper says neither how the time step is chosen nor when the flow has converged. Here each of
these rules is varied alone, and what it costs is counted: steps, factorisations, right-hand sides,
and CPU seconds over CEM's in the same process. Run it as

    python -m benchmarks.qiem_steps [--faces 3000] [--surface NAME ...]

It fills the table of docs/algorithms.md, unless surfaces are named: then it only prints.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

from cembench.algorithms import qiem as rules

from benchmarks.pages import fill
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.work import Work, counting
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from cembench.running.surfaces import generate_surface

PAGE = Path(__file__).parents[1] / "docs/algorithms.md"
SURFACES = tuple(
    f"{name}-stand-in"
    for name in ("nefertiti", "cowboy-hat", "chinese-vase", "foot", "stanford-bunny")
)
#: As it is, and one rule changed at a time: the first step, its growth, the tolerance.
USUAL: dict[str, float] = {"FIRST": 0.1, "GROWTH": 1.5, "tolerance": 1e-6}
VARIANTS: tuple[dict[str, float], ...] = (
    {},
    {"FIRST": 0.01},
    {"FIRST": 1.0},
    {"GROWTH": 1.1},
    {"GROWTH": 2.0},
    {"GROWTH": 4.0},
    {"tolerance": 1e-4},
    {"tolerance": 1e-5},
    {"tolerance": 1e-7},
    {"tolerance": 1e-8},
)
#: Enough for every variant; how many were needed is what the table tells.
MOST_STEPS = 2000


HEADING = """\
| first dt | growth | stop | steps | factorisations | over CEM's | right-hand sides over CEM's \
| CPU seconds over CEM's | E_C over CEM's |
|---:|---:|---:|---:|---:|---:|---:|---:|---:|"""


@contextmanager
def ruled(**changed: float) -> Iterator[None]:
    """Let the module's constants be these for a while."""
    before = {name: getattr(rules, name) for name in changed}
    vars(rules).update(changed)
    try:
        yield
    finally:
        vars(rules).update(before)


def called(name: str, mesh: TriangleMesh, **how: Any) -> tuple[Work, int, float, float]:
    """Return the work, iterations, E_C over the area, and CPU seconds of a call, warmed up."""
    function = load_registry().algorithm(name).function
    seconds = []
    for _ in range(2):
        with counting() as work:
            started = process_time()
            found = function(mesh.fresh(), **how)
            seconds.append(process_time() - started)
    metrics = all_metrics(mesh, found.uv)
    energy = metrics["conformal_energy"] / metrics["image_area"]
    return work, found.iterations, energy, seconds[-1]


def row(variant: dict[str, float], meshes: list[TriangleMesh]) -> str:
    """Return one line: medians over the surfaces."""
    steps, factored, ratios, solved, cpu, energies = [], [], [], [], [], []
    failed = 0
    constants = {k: v for k, v in variant.items() if k.isupper()}
    tolerance = variant.get("tolerance", USUAL["tolerance"])
    for mesh in meshes:
        base, _, best, base_cpu = called("cem", mesh)
        try:
            with ruled(**constants):
                work, count, energy, used = called(
                    "qiem", mesh, tolerance=tolerance, max_iterations=MOST_STEPS
                )
        except AlgorithmFailed:
            failed += 1
            continue
        steps.append(count)
        factored.append(work.numeric)
        ratios.append(work.numeric / base.numeric)
        solved.append(work.right_hand_sides / base.right_hand_sides)
        cpu.append(used / base_cpu)
        energies.append(energy / best)
    rule = {**USUAL, **variant}
    name = f"{rule['FIRST']:g} | {rule['GROWTH']:g} | {rule['tolerance']:g}"
    if not steps:
        return f"| {name} | none converged | | | | | |"
    spread = f"{min(steps)} to {max(steps)}" + (f", {failed} failed" if failed else "")
    return (
        f"| {name} | {median(steps):g} ({spread}) | {median(factored):g} | {median(ratios):.1f} "
        f"| {median(solved):.2f} | {median(cpu):.1f} | {median(energies):.4f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--faces", type=int, default=3000)
    parser.add_argument("--surface", action="append", default=[])
    asked = parser.parse_args()
    registry = load_registry()
    names = asked.surface or SURFACES
    meshes = [generate_surface(registry, name, asked.faces) for name in names]
    lines = []
    for variant in VARIANTS:
        lines.append(row(variant, meshes))
        print(lines[-1], flush=True)
    said = f"{', '.join(names)}, {asked.faces:,} triangles each; medians over them."
    if not asked.surface:
        fill(PAGE, "qiem_steps", "\n".join([said, "", HEADING, *lines]))


if __name__ == "__main__":
    main()
