"""How well closed surfaces and those with handles are mapped once they are cut to a disk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.mesh.topology import genus
from cembench.mesh.triangle_mesh import TriangleMesh

LAYOUT = """
| surface | genus | triangles | edges cut | mean angle error | folds |
|---|---:|---:|---:|---:|---:|
| {surface} | {genus} | {faces:,} | {edges:,} | {mean:.3g} | {folds:,} |"""


def cut_surfaces(meshes: Sequence[Path]) -> Section:
    """Cut surfaces to a disk as `cembench map --cut` does, and map them by Direct CEM."""
    return Section([Table([row(path) for path in progress(meshes)], LAYOUT)], "docs/repair.md")


def row(path: Path) -> dict[str, Any]:
    """Return a surface's genus, its cut, and the figures of its map."""
    surface = cembench.load_surface(path, (TriangleMesh,))
    cut = cembench.cut(surface)
    metrics = cembench.parameterize(cut.mesh, "direct-cem").metrics
    return {
        "surface": path.stem,
        "genus": genus(surface.F, surface.n, surface.loops),
        "faces": surface.m,
        "edges": len(cut.edges),
        "mean": metrics["angle_error_mean_deg"],
        "folds": metrics["flipped_triangles"],
    }
