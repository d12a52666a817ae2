"""Which surfaces with holes have a valid map by each algorithm, and how good it is."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, log
from pathlib import Path
from statistics import mean, median
from time import process_time
from typing import Any

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import angle_errors, boundary_circularity, flipped_triangles
from cembench.core.errors import AlgorithmFailed, MeshError, NotPositiveDefinite
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import load_registry
from cembench.running.map_promises import faults

NAMES = ("direct-cem-holes", "koebe-cem", "harmonic-filled")
SUFFIXES = (".npz", ".obj", ".ply", ".off")
#: Holes as round as this are circles.
ROUND = 1e-10
SURFACES = f"""
| surface | triangles | holes | {" | ".join(f"`{name}`" for name in NAMES)} |
|---|---:|---:|{"---:|" * len(NAMES)}
| {{surface}} | {{faces:,}} | {{holes}} | {" | ".join(f"{{told[{name}]}}" for name in NAMES)} |"""
SUMMARY = """
| algorithm | valid | of these round to 1e-10 | by the last resort | within 1 % of the best \
| mean ratio to the best | largest | median CPU seconds | largest |
|---|---:|---:|---:|---:|---:|---:|---:|---:|
| `{name}` | {valid} of {surfaces} | {round} | {resort} | {near} | {ratio:.3f} | {worst:.2f} \
| {median:.2f} | {slowest:.1f} |"""


def holed_surfaces(folders: Sequence[Path], *, faces: int = 150_000) -> Section:
    """Map every surface with holes below some folders by each algorithm, and judge the maps.

    The first table has the mean angle error of each valid map, in degrees; (n) after it is the
    number of folds of the method's own map, ~ a map with holes that are not round, which only
    harmonic-filled may have. Other entries are the folds that are left, another broken promise, or
    "failed".
    """
    surfaces = dict(holed_below(folders, faces))
    if not surfaces:
        raise SystemExit(f"no surface with holes is below {', '.join(map(str, folders))}.")
    outcomes = {
        name: {one: outcome(mesh, one) for one in NAMES}
        for name, mesh in progress(list(surfaces.items()))
    }
    bests = {
        name: min((one["angle"] for one in row.values() if one["valid"]), default=None)
        for name, row in outcomes.items()
    }
    rows = [
        {
            "surface": name,
            "faces": surfaces[name].m,
            "holes": len(surfaces[name].loops) - 1,
            "told": {one: row[one]["told"] for one in NAMES},
        }
        for name, row in outcomes.items()
    ]
    summary = [
        standing(one, [(row[one], bests[name]) for name, row in outcomes.items()]) for one in NAMES
    ]
    without = sum(best is None for best in bests.values())
    note = f"{without} of {len(outcomes)} surfaces have no valid map by any."
    return Section([Table(summary, SUMMARY), Table(rows, SURFACES), note], "docs/holes.md")


def holed_below(folders: Sequence[Path], faces: int) -> list[tuple[str, HoledMesh]]:
    """Return the surfaces with holes that have no more than so many triangles, by name."""
    below = []
    for path in sorted(p for folder in folders for p in folder.rglob("*") if p.suffix in SUFFIXES):
        try:
            mesh = read_mesh(path, HoledMesh)
        except MeshError:  # another kind of surface
            continue
        if mesh.m <= faces:
            below.append((path.stem, mesh))
    return below


def outcome(mesh: HoledMesh, name: str) -> dict[str, Any]:
    """Map a surface, and return what became of it."""
    algorithm, begun = load_registry().algorithm(name), process_time()
    try:
        made = algorithm.function(mesh.fresh(), **algorithm.arguments({}))
    except (AlgorithmFailed, NotPositiveDefinite):
        return {"valid": False, "told": "failed", "seconds": process_time() - begun}
    seconds = process_time() - begun
    folds, broken = flipped_triangles(mesh, made.uv), faults(algorithm, mesh, made.uv)
    angle = float(angle_errors(mesh, made.uv).mean())
    is_round = boundary_circularity(mesh, made.uv) < ROUND
    own = made.extras["folded_before_repair"]
    shown = f"{'' if is_round else '~ '}{angle:.2f}{f' ({own:,})' if own else ''}"
    return {
        "valid": not broken,
        "told": f"{folds:,} folds" if folds else shown if not broken else broken[0].kind,
        "angle": angle,
        "round": is_round,
        "resort": "last_resort" in made.extras,
        "seconds": seconds,
    }


def standing(name: str, outcomes: Sequence[tuple[dict[str, Any], float | None]]) -> dict[str, Any]:
    """Return an algorithm's counts, and how its angles compare with the best on each surface."""
    valid = [(one, best) for one, best in outcomes if one["valid"]]
    ratios = [one["angle"] / best for one, best in valid if best]
    seconds = [one["seconds"] for one, _ in outcomes]
    return {
        "name": name,
        "surfaces": len(outcomes),
        "valid": len(valid),
        "round": sum(one["round"] for one, _ in valid),
        "resort": sum(one["resort"] for one, _ in valid),
        "near": sum(ratio <= 1.01 for ratio in ratios),
        "ratio": exp(mean(map(log, ratios))),
        "worst": max(ratios),
        "median": median(seconds),
        "slowest": max(seconds),
    }
