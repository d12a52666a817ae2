"""How many disks end in a valid map by each tool, and at what cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import angle_errors, flipped_triangles, is_disk_map
from cembench.conformal.planar import turns
from cembench.core.errors import AlgorithmFailed, MeshError
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry

#: The last one is cetm-flips on the common refinement.
OVERLAY = "cetm-flips, overlay"
TOOLS = ("direct-cem", "bff", "cetm-flips", OVERLAY)
SUFFIXES = (".npz", ".obj", ".ply", ".off")
LAYOUT = """
| algorithm | disks | failed | folded | last resort | valid \
| angle error, times the folded map's: median | worst |
|---|---:|---:|---:|---:|---:|---:|---:|
| {algorithm} | {disks} | {failed} | {folded} | {resort} | {valid} | {median:.3f} | {worst:.2f} |"""


def last_resort(folders: Sequence[Path], *, faces: int = 150_000) -> Section:
    """Count the disks that end in a valid map by each tool, and what that cost in angles.

    Every surface below the folders that is a disk of at most `faces` triangles is mapped once.
    """
    disks = list(disks_below(folders, faces))
    outcomes = [[outcome(mesh, name) for name in TOOLS] for mesh in progress(disks)]
    rows = [row(name, [one[k] for one in outcomes]) for k, name in enumerate(TOOLS)]
    note = (
        f"{len(disks)} disks of up to {faces:,} triangles. Failed and folded: the method's own "
        "maps. Last resort: arcs widened, or the surface's mean value weights, on those and on "
        "crowded maps."
    )
    return Section([Table(rows, LAYOUT), note], "docs/algorithms.md")


def disks_below(folders: Sequence[Path], faces: int) -> Iterator[DiskMesh]:
    """Yield the disks in these folders with at most `faces` triangles."""
    for path in sorted(p for folder in folders for p in folder.rglob("*") if p.suffix in SUFFIXES):
        try:
            mesh = read_mesh(path, DiskMesh)
        except MeshError:  # not a disk
            continue
        if mesh.m <= faces:
            yield mesh


def outcome(mesh: DiskMesh, name: str) -> dict[str, Any]:
    """Map a disk, and return what happened to the method's own map and how the map ended."""
    algorithm = load_registry().algorithm(name.partition(",")[0])
    call = algorithm.refinement if name == OVERLAY else algorithm.function
    try:
        made = call(mesh.fresh(), **algorithm.arguments({}))
    except AlgorithmFailed:
        return {"failed": True, "valid": False, "folded": False, "resort": False, "cost": None}
    uv, extras = made.uv, made.extras
    mesh = made.mesh if name == OVERLAY else mesh
    before = extras.get("before_repair", {}).get("angle_error_mean_deg")
    return {
        "failed": "failure" in extras,
        "folded": extras["folded_before_repair"] > 0,
        "resort": "last_resort" in extras,
        "valid": not flipped_triangles(mesh, uv)
        and is_disk_map(mesh, uv)
        and turns(uv[mesh.boundary])[0] == 1,
        "cost": angle_errors(mesh, uv).mean() / before if before else None,
    }


def row(name: str, outcomes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return an algorithm's row: counts, and the median and largest cost in angles."""
    counts = {
        what: sum(bool(one[what]) for one in outcomes)
        for what in ("failed", "folded", "resort", "valid")
    }
    costs = [one["cost"] for one in outcomes if one["cost"] is not None] or [np.nan]
    about = {"algorithm": name, "disks": len(outcomes)}
    return about | counts | {"median": float(np.median(costs)), "worst": max(costs)}
