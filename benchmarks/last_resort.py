"""How many disks end in a valid map by each tool, and at what cost. Fills a table of a page.

Every surface below the folders that is a disk is mapped once, without a clock::

    python -m benchmarks.last_resort FOLDER... [--faces 150000]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from benchmarks.pages import ROOT, fill
from cembench.conformal.metrics import angle_errors, flipped_triangles, is_disk_map
from cembench.conformal.planar import turns
from cembench.core.errors import AlgorithmFailed, MeshError
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry

PAGE = ROOT / "docs/algorithms.md"
TOOLS = ("direct-cem", "bff", "cetm-flips")
SUFFIXES = (".npz", ".obj", ".ply", ".off")


def main() -> None:
    """Map every disk by every tool, and write the shares that are valid."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with meshes")
    parser.add_argument("--faces", type=int, default=150_000, help="most triangles of a disk")
    chosen = parser.parse_args()
    disks = list(disks_below(chosen.folders, chosen.faces))
    outcomes = pd.DataFrame([outcome(mesh, name) for mesh in disks for name in TOOLS])
    by_tool = outcomes.groupby("algorithm", sort=False)
    titles = (
        "algorithm",
        "disks",
        "failed",
        "folded",
        "last resort",
        "valid",
        "angle error, times the folded map's: median",
        "worst",
    )
    lines = [f"| {' | '.join(titles)} |", f"|---{'|---:' * (len(titles) - 1)}|"]
    lines += [f"| {name} | {' | '.join(cells(rows))} |" for name, rows in by_tool]
    note = (
        f"{len(disks)} disks of up to {chosen.faces:,} triangles. Failed and folded: the method's "
        "own maps. Last resort: arcs widened, or the surface's mean value weights, on those and on "
        "crowded maps."
    )
    fill(PAGE, Path(__file__).stem, "\n".join([*lines, "", note]))


def disks_below(folders: list[Path], faces: int) -> Iterator[DiskMesh]:
    """Give the disks in these folders that have no more than so many triangles."""
    for path in sorted(p for folder in folders for p in folder.rglob("*") if p.suffix in SUFFIXES):
        try:
            mesh = read_mesh(path, DiskMesh)
        except MeshError:  # not a disk
            continue
        if mesh.m <= faces:
            yield mesh


def outcome(mesh: DiskMesh, name: str) -> dict[str, object]:
    """Map a disk, and return what happened to the method's own map and how the map ended."""
    algorithm = load_registry().algorithm(name)
    try:
        made = algorithm.function(mesh.fresh(), **algorithm.arguments({}))
    except AlgorithmFailed:
        return {"algorithm": name, "failed": True, "valid": False, "folded": False, "resort": False}
    uv, extras = made.uv, made.extras
    before = extras.get("before_repair", {}).get("angle_error_mean_deg")
    return {
        "algorithm": name,
        "failed": "failure" in extras,
        "folded": extras["folded_before_repair"] > 0,
        "resort": "last_resort" in extras,
        "valid": not flipped_triangles(mesh, uv)
        and is_disk_map(mesh, uv)
        and turns(uv[mesh.boundary])[0] == 1,
        "cost": angle_errors(mesh, uv).mean() / before if before else None,
    }


def cells(rows: pd.DataFrame) -> list[str]:
    """Return the cells of an algorithm's row."""
    counts = [str(int(rows[name].sum())) for name in ("failed", "folded", "resort", "valid")]
    cost = rows["cost"].dropna()
    return [str(len(rows)), *counts, f"{cost.median():.3f}", f"{cost.max():.2f}"]


if __name__ == "__main__":
    main()
