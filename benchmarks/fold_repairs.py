"""What the repair of folds does to maps: their E_C and angles before and after."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.last_resort import disks_below
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry

#: Methods whose own map is repaired, and which have no other one to fall back on.
NAMES = ("cem", "fdm", "ldm", "qiem", "harmonic-circle")
FIGURES = {"energy": "conformal_energy", "angle": "angle_error_mean_deg"}
LAYOUT = """
| surface | triangles | method | folds | left | E_C before | after | mean angle before | after |
|---|---:|---|---:|---:|---:|---:|---:|---:|
| {surface} | {faces:,} | {name} | {folds:,} | {left} | {before[energy]:.5f} \
| {after[energy]:.5f} | {before[angle]:.3f} | {after[angle]:.3f} |"""


def fold_repairs(folders: Sequence[Path], *, faces: int = 100_000) -> Section:
    """Tabulate every map of the disks below some folders that has folds before it is repaired.

    A repair that costs too much is refused; the figures after it are those of the refused map.
    """
    disks = list(disks_below(folders, faces))
    return Section(
        [Table([row for mesh in progress(disks) for row in rows(mesh)], LAYOUT)],
        "docs/algorithms.md",
    )


def rows(mesh: DiskMesh) -> Iterator[dict[str, Any]]:
    """Yield the figures of each method's map of a disk, if it folds."""
    for algorithm in map(load_registry().algorithm, NAMES):
        try:
            made = algorithm.function(mesh.fresh(), **algorithm.arguments({}))
        except AlgorithmFailed:
            continue
        folds = made.extras["folded_before_repair"]
        if not folds:
            continue
        figures = all_metrics(mesh, made.uv)
        refused = made.extras.get("refused_repair")
        before, after = made.extras.get("before_repair", figures), refused or figures
        yield {
            "surface": mesh.name,
            "faces": mesh.m,
            "name": algorithm.name,
            "folds": folds,
            "left": "refused" if refused else f"{figures['flipped_triangles']:,}",
            "before": {short: before[name] for short, name in FIGURES.items()},
            "after": {short: after[name] for short, name in FIGURES.items()},
        }
