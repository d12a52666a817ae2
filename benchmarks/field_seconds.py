"""What every disk and free-boundary algorithm costs on three surfaces."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from statistics import median

from benchmarks.field import algorithms
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.core.errors import CembenchError
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm

#: What the cost is measured on and beside, and how often.
SURFACES = ("chinese_lion.obj", "left_hand.obj", "jacksboro_dem.ply")
BESIDE, ROUNDS = "direct-cem", 3
#: By the surface and the algorithm: CPU seconds, and their ratio to the other's; None: it refused.
Costs = Mapping[str, Mapping[str, tuple[float, float] | None]]


def field_seconds(folder: Path, *, longest: float = 60) -> Section:
    """Measure what every algorithm for disks costs on three surfaces of a folder.

    CPU seconds, each algorithm in turns with direct-cem in one process, so that the ratio of both
    is what to rely on; medians of three after a call to warm up. An algorithm that takes longer
    than `longest` is called once. Run it on a quiet machine.
    """
    warnings.simplefilter("ignore")
    known = algorithms()
    surfaces = [name for name in SURFACES if (folder / name).is_file()]
    if not surfaces:
        sys.exit(f"{folder} has none of {', '.join(SURFACES)}.")
    meshes = {name: read_mesh(folder / name) for name in surfaces}
    costs = {name: costs_on(meshes[name], known, longest) for name in progress(surfaces)}
    return Section([table(costs, known)], "docs/algorithms.md")


def costs_on(
    mesh: DiskMesh, known: Iterable[Algorithm], longest: float
) -> dict[str, tuple[float, float] | None]:
    """Return the median CPU seconds of each algorithm, and over those of the one beside it."""
    (beside,) = (spec for spec in known if spec.name == BESIDE)
    return {spec.name: _cost(spec, beside, mesh, longest) for spec in known}


def _cost(
    spec: Algorithm, beside: Algorithm, mesh: DiskMesh, longest: float
) -> tuple[float, float] | None:
    pairs = []
    for k in range(ROUNDS + 1):
        try:
            pair = (cpu_seconds(spec, mesh), cpu_seconds(beside, mesh))
        except CembenchError:
            return None
        if k or pair[0] > longest:
            pairs.append(pair)
        if pair[0] > longest:
            break
    return median(ours for ours, _ in pairs), median(a / b for a, b in pairs)


def cpu_seconds(spec: Algorithm, mesh: DiskMesh) -> float:
    """Return the CPU seconds of one call."""
    fresh = mesh.fresh()
    started = time.process_time()
    spec.function(fresh, **spec.arguments({}))
    return time.process_time() - started


def table(costs: Costs, known: Iterable[Algorithm]) -> Table:
    """Return a row an algorithm: CPU seconds and their ratio to direct-cem's on each surface."""
    heads = "".join(f" {name}, s | / {BESIDE} |" for name in costs)
    cells = "".join(f" {{cost{k}[0]:.3g}} | {{cost{k}[1]:.2f}} |" for k in range(len(costs)))
    layout = f"| algorithm | target |{heads}\n|---|---|{'---:|' * (2 * len(costs))}\n"
    rows = [
        {"algorithm": spec.name, "target": spec.target}
        | {f"cost{k}": row.get(spec.name) or (None, None) for k, row in enumerate(costs.values())}
        for spec in known
    ]
    return Table(rows, layout + f"| `{{algorithm}}` | {{target}} |{cells}")
