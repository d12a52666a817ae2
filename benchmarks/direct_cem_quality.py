"""Direct CEM beside the other disk maps, each with its own weights and with Delaunay weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import ldm
from cembench.algorithms.qiem import qiem
from numpy.typing import NDArray

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench import AlgorithmFailed, DiskMesh, Parameterization
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.metrics import angle_errors, dirichlet_energy, flipped_triangles, image_area
from cembench.mesh.files import read_mesh
from cembench.morphing.align import to_centre

PAPER = {"CEM": cem, "FDM": fdm, "LDM": ldm, "QIEM": qiem}
#: What is compared, by the parameters besides the weights.
CALLS: dict[str, Callable[..., Parameterization]] = {
    **PAPER,
    "CEM 200": partial(cem, max_iterations=200, tolerance=0, stop="change"),
    "direct": direct_cem,
    "direct, back=0": partial(direct_cem, back=0),
}
#: With the weights of each method's paper, and with intrinsic Delaunay weights, marked D.
METHODS = {
    name + suffix: partial(call, delaunay=delaunay)
    for suffix, delaunay in (("", False), (" D", True))
    for name, call in CALLS.items()
}
FIGURES = ("angle", "mu", "energy")
OTHERS = [name for name in METHODS if name not in PAPER]
RATIOS = f"""
| surface | figure | {" | ".join(OTHERS)} |
|---|---|{"---:|" * len(OTHERS)}
| {{surface}} | {{figure}} | {" | ".join(f"{{ratios[{name}]:.3f}}" for name in OTHERS)} |"""
SUMMARY = """
| method | figure | surfaces | geometric mean | worst | within 1 % |
|---|---|---:|---:|---:|---:|
| {method} | {figure} | {surfaces} | {mean:.3f} | {worst:.3f} | {near} |"""


def direct_cem_quality(meshes: Sequence[Path]) -> Section:
    """Compare direct CEM with the other disk maps, each with both kinds of weights.

    For every surface the mean angle error, the mean of |mu| over the surface's area and the
    conformal energy of each method, as multiples of the best of CEM, FDM, LDM and QIEM with the
    weights of their papers; then geometric means, worst cases and how many are within 1 %. Methods
    with intrinsic Delaunay weights are marked D. Energies are compared in one gauge, the surface's
    area centred in the disk, with the surface's own cotangents.
    """
    rows = []
    for path in progress(meshes):
        surface = read_mesh(path)
        measured = ratios(DiskMesh.from_arrays(surface.V, surface.F))
        for k, figure in enumerate(FIGURES):
            both = {name: measured[name][k] if name in measured else None for name in METHODS}
            rows.append({"surface": path.stem, "figure": figure, "ratios": both})
    summary = []
    for name in METHODS:
        for figure in FIGURES:
            some = [one["ratios"][name] for one in rows if one["figure"] == figure]
            x = np.array([ratio for ratio in some if ratio is not None])
            mean, near = np.exp(np.log(x).mean()), (x < 1.01).sum()
            summary.append({"method": name, "figure": figure, "surfaces": len(x), "mean": mean,
                            "worst": x.max(), "near": near})  # fmt: skip
    return Section([Table(rows, RATIOS), Table(summary, SUMMARY)])


def figures(mesh: DiskMesh, uv: NDArray[np.complex128]) -> tuple[float, float, float]:
    """Return the figures of a map, in the order of `FIGURES`."""
    mu = np.minimum(np.abs(beltrami_coefficients(uv, mesh.F, mesh.V)), 1)
    share = gauge_measure(mesh, "area", mesh.boundary)
    for _ in range(100):
        uv = to_centre(complex(share @ uv))(uv)
    a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    energy = dirichlet_energy(mesh, uv) - image_area(mesh, uv)
    return float(angle_errors(mesh, uv).mean()), float(mu @ area / area.sum()), energy


def ratios(mesh: DiskMesh) -> dict[str, NDArray[np.float64]]:
    """Return each valid map's figures as multiples of the paper's methods' best."""
    measured = {}
    for name, method in METHODS.items():
        try:
            uv = method(mesh.fresh()).uv
        except AlgorithmFailed:
            continue
        if not flipped_triangles(mesh, uv):
            measured[name] = np.array(figures(mesh, uv))
    best = np.min([measured[name] for name in PAPER if name in measured], axis=0)
    return {name: values / best for name, values in measured.items()}
