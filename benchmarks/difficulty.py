"""Which disk algorithms bear a jagged boundary, thin triangles and a rough surface?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import matplotlib as mpl
from cembench.surfaces.catalogue import body_mesh
from cembench.surfaces.levers import Levers, hardened

from benchmarks.measuring import png, progress
from benchmarks.pages import Section, Table
from cembench.conformal.laplacian import non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import CembenchError
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.running.map_promises import faults

mpl.use("Agg")
import matplotlib.pyplot as plt

#: The body whose difficulty is varied.
BODY = "chinese-lion-stand-in"
JAG, NON_DELAUNAY, GAIN = (0.0, 0.3, 0.6, 0.9), (0.0, 0.05, 0.15), (0.5, 1.0, 1.5)
#: Levels of (jag, share of non-Delaunay edges, gain) that the table shows, by what is hard in them.
SHOWN = {
    "easy": (0.0, 0.0, 0.5),
    "jagged": (0.9, 0.0, 0.5),
    "thin": (0.0, 0.15, 0.5),
    "rough": (0.0, 0.0, 1.5),
    "all": (0.9, 0.15, 1.5),
}
#: Algorithms that the plot shows.
PLOTTED = ("fdm", "ldm", "qiem", "cem", "direct-cem", "bff", "cetm-flips")
LAYOUT = """
| algorithm | valid maps | mean angle error: easy | jagged | thin | rough | all three \
| E_C: easy | jagged | thin | rough | all three | folds, all three | iterations: easy | all three |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {algorithm} | {valid} of {of} | {easy[angle]:.2f} | {jagged[angle]:.2f} | {thin[angle]:.2f} \
| {rough[angle]:.2f} | {all[angle]:.2f} | {easy[energy]:.4f} | {jagged[energy]:.4f} \
| {thin[energy]:.4f} | {rough[energy]:.4f} | {all[energy]:.4f} | {all[folds]:.0f} \
| {easy[iterations]:.0f} | {all[iterations]:.0f} |"""
Level = tuple[float, float, float]


def difficulty(*, faces: int = 20_000) -> Section:
    """Map one body with every disk algorithm over jag, non-Delaunay edges and roughness.

    All surfaces have the same numbers of vertices, triangles and boundary vertices.
    """
    body = body_mesh(BODY, faces)
    levels: list[Level] = list(product(JAG, NON_DELAUNAY, GAIN))
    names = [n for n, one in load_registry().algorithms.items() if one.target == "disk"]
    found: dict[str, dict[Level, dict[str, Any]]] = {name: {} for name in names}
    for level in progress(levels):
        jag, share, gain = level
        mesh = hardened(body, Levers(jag=jag, non_delaunay=share, gain=gain))
        assert abs(non_delaunay_share(mesh) - share) < 0.02
        for name in names:
            found[name][level] = mapped(mesh, name)
    rows = [
        {
            "algorithm": name,
            "valid": sum(bool(one["valid"]) for one in maps.values()),
            "of": len(levels),
            **{what: maps[level] for what, level in SHOWN.items()},
        }
        for name, maps in found.items()
    ]
    about = (
        f"One body of {body.m:,} triangles and {len(body.loops[0])} boundary vertices. Easy: half "
        f"its relief, a smooth boundary, Delaunay triangles. Jagged: jag {JAG[-1]}. Thin: "
        f"{NON_DELAUNAY[-1]:.0%} of the edges not Delaunay. Rough: {GAIN[-1]} times the relief. "
        "A dash: no map, or none that is valid."
    )
    picture = {"docs/difficulty.png": picture_of(found)}
    return Section([about, Table(rows, LAYOUT)], "docs/surfaces.md", picture)


def mapped(mesh: DiskMesh, name: str) -> dict[str, Any]:
    """Return the figures of an algorithm's map, none if it is not valid."""
    mapper = load_registry().algorithm(name)
    try:
        result = mapper.function(mesh.fresh(), **mapper.arguments({}))
    except CembenchError:
        return dict.fromkeys(("valid", "angle", "energy", "folds", "iterations"))
    metrics = all_metrics(mesh, result.uv)
    valid = not faults(mapper, mesh, result.uv)
    return {
        "valid": valid,
        "angle": metrics["angle_error_mean_deg"] if valid else None,
        "energy": metrics["conformal_energy"] if valid else None,
        "folds": metrics["flipped_triangles"],
        "iterations": result.iterations or None,
    }


def picture_of(found: Mapping[str, Mapping[Level, Mapping[str, Any]]]) -> bytes:
    """Draw mean angle errors and energies against jag, thin triangles dashed."""
    figure, axes = plt.subplots(
        2, len(GAIN), figsize=(9.5, 6), sharex=True, sharey="row", layout="constrained"
    )
    for row, what in enumerate(("angle", "energy")):
        for axis, gain in zip(axes[row], GAIN, strict=True):
            for k, name in enumerate(PLOTTED):
                for share, dash in ((NON_DELAUNAY[0], "-"), (NON_DELAUNAY[-1], "--")):
                    values = [found[name][jag, share, gain][what] for jag in JAG]
                    label = load_registry().algorithm(name).title if dash == "-" else None
                    axis.plot(
                        JAG, _with_gaps(values), dash, marker="o", ms=3, color=f"C{k}", label=label
                    )
            axis.set_yscale("log")
            if row == 0:
                axis.set_title(f"{gain:g} times the relief", fontsize=9)
    axes[0, 0].set_ylabel("mean angle error (degrees)")
    axes[1, 0].set_ylabel("conformal energy E_C")
    figure.supxlabel("jag of the boundary; dashed: 15 % of the edges not Delaunay", fontsize=9)
    axes[0, -1].legend(fontsize=7)
    return png(figure, dpi=110)


def _with_gaps(values: Sequence[float | None]) -> list[float]:
    return [float("nan") if value is None else float(value) for value in values]
