"""How much do QIEM's own rules decide how it stands to CEM?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from statistics import median
from time import process_time
from typing import Any

from cembench.algorithms import qiem as rules

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.work import Work, counting
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from cembench.running.surfaces import generate_surface

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
#: Enough for every variant; the table has the number needed.
MAX_STEPS = 2000
LAYOUT = """
| first dt | growth | stop | steps | factorisations | over CEM's | right-hand sides over CEM's \
| CPU seconds over CEM's | E_C over CEM's |
|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {FIRST:g} | {GROWTH:g} | {tolerance:g} | {steps} | {numeric:g} | {ratio:.1f} | {solved:.2f} \
| {cpu:.1f} | {energy:.4f} |"""


def qiem_steps(surfaces: Sequence[str] = SURFACES, *, faces: int = 3000) -> Section:
    """Measure how much QIEM's own rules decide how it stands to CEM.

    The paper says neither how the time step is chosen nor when the flow has converged. Each of
    these rules is varied alone, and what it costs is counted: steps, factorisations, right-hand
    sides, and CPU seconds over CEM's in the same process; medians over generated surfaces.
    """
    registry = load_registry()
    meshes = [generate_surface(registry, name, faces) for name in surfaces]
    rows = [row(variant, meshes) for variant in progress(VARIANTS)]
    note = f"{', '.join(surfaces)}, {faces:,} triangles each; medians over them."
    return Section([note, Table(rows, LAYOUT)], "docs/readings.md")


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
            result = function(mesh.fresh(), **how)
            seconds.append(process_time() - started)
    metrics = all_metrics(mesh, result.uv)
    energy = metrics["conformal_energy"] / metrics["image_area"]
    return work, result.iterations, energy, seconds[-1]


def row(variant: dict[str, float], meshes: list[TriangleMesh]) -> dict[str, Any]:
    """Return the medians of one set of rules over the surfaces."""
    constants = {k: v for k, v in variant.items() if k.isupper()}
    rule = {**USUAL, **variant}
    steps, figures = [], []
    for mesh in meshes:
        base, _, best, base_cpu = called("cem", mesh)
        with suppress(AlgorithmFailed), ruled(**constants):
            work, count, energy, cpu = called(
                "qiem", mesh, tolerance=rule["tolerance"], max_iterations=MAX_STEPS
            )
            steps.append(count)
            figures.append(
                {
                    "numeric": work.numeric,
                    "ratio": work.numeric / base.numeric,
                    "solved": work.right_hand_sides / base.right_hand_sides,
                    "cpu": cpu / base_cpu,
                    "energy": energy / best,
                }
            )
    if not steps:
        names = ("numeric", "ratio", "solved", "cpu", "energy")
        return {**rule, "steps": "none converged", **dict.fromkeys(names)}
    failed = len(meshes) - len(steps)
    spread = f"{min(steps)} to {max(steps)}" + (f", {failed} failed" if failed else "")
    middle = {name: median(one[name] for one in figures) for name in figures[0]}
    return {**rule, "steps": f"{median(steps):g} ({spread})", **middle}
