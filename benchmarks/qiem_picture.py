"""What each further step of QIEM's flow is worth on real surfaces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from cembench.algorithms import qiem as rules
from cembench.algorithms.cem import cem

from benchmarks.measuring import png, progress
from benchmarks.pages import Section
from benchmarks.qiem_steps import MAX_STEPS, ruled
from cembench.conformal.doubling import doubled_surface
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.metrics import all_metrics
from cembench.core.arrays import Complex
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh

mpl.use("Agg")
import matplotlib.pyplot as plt

#: First time step and growth of each curve; the first one is used.
CURVES = ((0.1, 1.5), (1.0, 1.5), (0.1, 4.0))
TOLERANCES = (1e-4, 1e-6, 1e-8)
USED = 1e-6
#: E_C is settled when it stays as near as this to that of the converged flow.
SETTLED = 1e-3


def energy(mesh: DiskMesh, uv: Any) -> float:
    """E_C over the image's area."""
    metrics = all_metrics(mesh, uv)
    return float(metrics["conformal_energy"] / metrics["image_area"])


@contextmanager
def remembering() -> Iterator[list[Any]]:
    """Yield a list that gets every trial of the flow, None for one that failed."""
    centred, tried = rules._centred, list[Any]()

    def remembered(S: Any, mass: Any) -> Any:
        tried.append(centred(S, mass))
        return tried[-1]

    vars(rules)["_centred"] = remembered
    try:
        yield tried
    finally:
        vars(rules)["_centred"] = centred


def flow(mesh: DiskMesh, first: float, growth: float) -> tuple[list[float], dict[float, int]]:
    """Return E_C of the map after every factorisation, and how many each tolerance takes."""
    ends = {}
    with remembering() as tried:
        for tolerance in sorted(TOLERANCES, reverse=True):  # the longest flow is remembered last
            tried.clear()
            with ruled(FIRST=first, GROWTH=growth):
                rules.qiem(mesh.fresh(), tolerance=tolerance, max_iterations=MAX_STEPS)
            ends[tolerance] = len(tried) - 1
    return [math.nan if z is None else energy(mesh, z) for z in finished(mesh, tried)], ends


def finished(mesh: DiskMesh, tried: list[Any]) -> Iterator[Complex | None]:
    """Yield the disk map after each trial, None where the sphere's energy was not lowered."""
    L, _, L_double, _ = doubled_surface(mesh)
    least = math.inf
    for S in tried:
        on_sphere = math.inf if S is None else float((S * (L_double @ S)).sum())
        if S is not None and on_sphere <= least:
            least = on_sphere
            yield harmonic_extension(L, mesh.boundary, rules.boundary_on_circle(mesh, S))
        else:
            yield None


def qiem_picture(meshes: Sequence[Path]) -> Section:
    """Draw what each further step of QIEM's flow is worth on real surfaces.

    The map that a user would get if the flow ended there is finished after every step: boundary on
    the circle, interior solved for. Rings mark where tolerances end the flow.
    """
    lines = []
    rows = math.ceil(len(meshes) / 3)
    size = (9.5, 3 * rows + 0.5)
    figure, axes = plt.subplots(rows, 3, figsize=size, squeeze=False, layout="constrained")
    for axis in axes.flat[len(meshes) :]:
        axis.set_axis_off()
    for path, axis in zip(progress(meshes), axes.flat, strict=False):
        mesh = read_mesh(path)
        curves = [flow(mesh, first, growth) for first, growth in CURVES]
        end = curves[0][0][curves[0][1][min(TOLERANCES)]]
        by_cem = energy(mesh, cem(mesh.fresh()).uv) / end
        axis.axhline(by_cem, color="0.6", lw=1, ls="--", label="CEM")
        for (first, growth), (energies, ends) in zip(CURVES, curves, strict=True):
            over = np.array(energies) / end
            held = np.flatnonzero(np.isfinite(over))  # the others are trials that were rejected
            name = f"dt {first:g}, growth {growth:g}"
            (drawn,) = axis.plot(held, over[held], lw=1.3, label=name)
            for tolerance, steps in ends.items():
                used = tolerance == USED and (first, growth) == CURVES[0]
                face = drawn.get_color() if used else "none"
                style = {"ms": 7, "mec": drawn.get_color(), "mfc": face}
                axis.plot(steps, over[steps], "o", **style)
            settled = held[np.flatnonzero(np.abs(over[held] - 1) > SETTLED).max(initial=-1) + 1]
            within = f"within {SETTLED:.1%} from trial {settled}"
            lines.append(f"{path.stem}, {name}: {within}, ends: {ends}")
        axis.set_title(f"{path.stem.replace('_', ' ')}, {mesh.m:,} triangles", fontsize=9)
        axis.set_ylim(0.99, 1.2)
        axis.tick_params(labelsize=8)
    axes[0, 0].legend(fontsize=7)
    figure.supxlabel("trial steps of the flow, a factorisation each", fontsize=9)
    figure.supylabel("E_C over that of the converged flow", fontsize=9)
    return Section(["\n".join(lines)], files={"docs/qiem_steps.png": png(figure, dpi=110)})
