"""What further sweeps of Koebe's method give on surfaces with holes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cembench.algorithms.koebe_cem.koebe_cem import koebe_cem

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench import AlgorithmFailed
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import HoledMesh

#: Sweeps are enough where E_C is at most so many times the lowest.
NEAR = 1.01
LAYOUT = """
| surface | triangles | holes | sweeps | E_C | mean angle error | SD | folds | iterations \
| off circles before rounding |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {surface} | {faces:,} | {holes} | {sweeps} | {energy:.4f} | {mean:.2f} | {sd:.2f} | {folds:,} \
| {iterations} | {off:.3f} |"""


def koebe_sweeps(meshes: Sequence[Path], *, most: int = 8) -> Section:
    """Compare a sweep of Koebe's method with as many as help.

    For each surface with holes one sweep, and the first number of sweeps whose map has no fold and
    an E_C within 1 % of the lowest of 1 to `most`. A dash: the method failed.
    """
    surfaces = [read_mesh(path, HoledMesh).renamed(path.stem) for path in meshes]
    return Section(
        [Table([row for one in progress(surfaces, "surface") for row in rows(one, most)], LAYOUT)],
        "docs/holes.md",
    )


def rows(mesh: HoledMesh, most: int) -> list[dict[str, Any]]:
    """Return the figures of each map of a surface."""
    swept = [row(mesh, k) for k in range(1, most + 1)]
    valid = [one for one in swept if one["folds"] == 0]
    least = min((one["energy"] for one in valid), default=0.0)
    near = [one for one in valid if one["energy"] <= NEAR * least][:1]
    return [swept[0], *(one for one in near if one is not swept[0])]


def row(mesh: HoledMesh, sweeps: int) -> dict[str, Any]:
    """Return the figures of a map; none if the method fails."""
    about = {"surface": mesh.name, "faces": mesh.m, "holes": len(mesh.loops) - 1, "sweeps": sweeps}
    try:
        made = koebe_cem(mesh.fresh(), sweeps=sweeps)
    except AlgorithmFailed:
        return about | dict.fromkeys(("energy", "mean", "sd", "folds", "iterations", "off"))
    figures = all_metrics(mesh, made.uv)
    return about | {
        "energy": figures["conformal_energy"],
        "mean": figures["angle_error_mean_deg"],
        "sd": figures["angle_error_sd_deg"],
        "folds": figures["flipped_triangles"],
        "iterations": made.iterations,
        "off": made.extras.get("circularity_before_rounding"),
    }
