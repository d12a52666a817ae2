"""How near each map to the disk comes to the best angles, on every disk of some folders."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from math import exp, log
from pathlib import Path
from statistics import mean, median
from typing import Any

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table

#: direct-cem with five steps whose weights count all triangles alike.
EVEN = "direct-cem, even=5"
#: Algorithms that are compared; `best` is judged by the best of the others.
NAMES = ("best", "direct-cem", EVEN, "cetm-flips", "cetm", "bff", "fdm", "cem", "qiem", "ldm")
#: Angle errors below this, in degrees, are of flat surfaces: ratios of them mean nothing.
FLAT = 0.01
#: A map is near the best with at most so many times its angle error.
NEAR = 1.01
LAYOUT = """
| algorithm | valid maps | within 1 % of the best | mean ratio to the best | largest | seconds \
over direct-cem's |
|---|---:|---:|---:|---:|---:|
| `{name}` | {valid} of {disks} | {near} | {ratio:.3f} | {worst:.2f} | {seconds:.1f} |"""


def best_maps(folders: Sequence[str], *, largest: int = 20_000) -> Section:
    """Compare the mean angle errors of maps to the disk on every disk of some folders.

    Disks of more than `largest` vertices and flat ones are left out. The mean of the ratios is
    geometric, of valid maps; seconds are medians of ratios of single calls.
    """
    maps, surfaces = [], []
    for path in progress(sorted(chain(*(map(str, Path(f).iterdir()) for f in folders)))):
        if (mesh := _disk(path, largest)) is not None:
            maps.append({name: _map(mesh, name) for name in NAMES})
            surfaces.append(mesh.name)
    others = [{n: e for n, (e, _) in row.items() if n != "best" and e is not None} for row in maps]
    bests = [min(row.values(), default=0.0) for row in others]
    held = [(row, best) for row, best in zip(maps, bests, strict=True) if best > FLAT]
    rows = [_row(name, held) for name in NAMES]
    missed = [
        f"`best` has {row['best'][0] / best:.3f} times the least angle error on {surface}."
        for surface, row, best in zip(surfaces, maps, bests, strict=True)
        if best > FLAT and row["best"][0] is not None and row["best"][0] > NEAR * best
    ]
    return Section(
        [Table(rows, LAYOUT), " ".join([f"{len(held)} disks.", *missed])], "docs/maps.md"
    )


def _disk(path: str, largest: int) -> cembench.DiskMesh | None:
    try:
        mesh = cembench.load_surface(path, (cembench.DiskMesh,))
    except cembench.MeshError:
        return None
    return mesh if mesh.n <= largest else None


def _map(mesh: cembench.DiskMesh, name: str) -> tuple[float | None, float | None]:
    try:
        parameters = {"even": 5} if name == EVEN else {}
        result = cembench.parameterize(mesh, name.partition(",")[0], check="fast", **parameters)
    except cembench.AlgorithmFailed:
        return None, None
    return float(result.metrics["angle_error_mean_deg"] or 0.0), result.seconds


def _row(name: str, held: Sequence[tuple[dict[str, Any], float]]) -> dict[str, Any]:
    ratios = [row[name][0] / best for row, best in held if row[name][0] is not None]
    times = [
        row[name][1] / row["direct-cem"][1]
        for row, _ in held
        if row[name][1] and row["direct-cem"][1]
    ]
    return {
        "name": name,
        "disks": len(held),
        "valid": len(ratios),
        "near": sum(ratio <= NEAR for ratio in ratios),
        "ratio": exp(mean(map(log, ratios))),
        "worst": max(ratios),
        "seconds": median(times),
    }
