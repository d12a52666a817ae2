"""Direct CEM beside the other disk maps, each with its own weights and with Delaunay weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import ldm
from cembench.algorithms.qiem import qiem
from cembench.papers.cem.morphing.align import to_centre
from numpy.typing import NDArray

from benchmarks.disks import disk_of
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench import AlgorithmFailed, DiskMesh, Parameterization
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.metrics import angle_errors, dirichlet_energy, flipped_triangles, image_area

PAPER = {"CEM": cem, "FDM": fdm, "LDM": ldm, "QIEM": qiem}
#: What is compared, by the parameters besides the weights.
CALLS: dict[str, Callable[..., Parameterization]] = {
    **PAPER,
    "CEM, 200 iterations": partial(cem, max_iterations=200, tolerance=0, stop="change"),
    "Direct CEM": direct_cem,
    "Direct CEM, `back=0`": partial(direct_cem, back=0),
}
#: With the weights of each method's paper, and with intrinsic Delaunay weights, marked D.
METHODS = {
    name + suffix: partial(call, delaunay=delaunay)
    for suffix, delaunay in (("", False), (" D", True))
    for name, call in CALLS.items()
}
FIGURES = ("angle", "mu", "energy")
#: The columns of the first table: direct CEM with each weights, and without the way back.
SHOWN = {
    "own weights": "Direct CEM",
    "Delaunay": "Direct CEM D",
    "Delaunay, `back=0`": "Direct CEM, `back=0` D",
}
_FIRST, *_OTHERS = ("mean angle", "mean \\|mu\\|", "E_C")
RATIOS = f"""
| surface | triangles | {_FIRST}: {" | ".join(SHOWN)} | {
    " | ".join(f"{what}: {' | '.join(SHOWN)}" for what in _OTHERS)
} |
|---|{"---:|" * (1 + len(FIGURES) * len(SHOWN))}
| {{surface}} | {{faces:,}} | {
    " | ".join(f"{{{figure}[{name}]:.3f}}" for figure in FIGURES for name in SHOWN.values())
} |"""
SUMMARY = f"""
| method | weights | {_FIRST} | {" | ".join(_OTHERS)} |
|---|---|---:|---:|---:|
| {{method}} | {{weights}} | {
    " | ".join(
        f"{{{figure}[mean]:.3f}}, {{{figure}[worst]:.3f}}, {{{figure}[near]}}" for figure in FIGURES
    )
} |"""


def direct_cem_quality(surfaces: Sequence[str]) -> Section:
    """Compare direct CEM with the other disk maps, each with both kinds of weights.

    For every surface, a mesh file or NAME@TRIANGLES for a generated one, the mean angle error, the
    mean of |mu| over the surface's area and the conformal energy of each method, as multiples of
    the best of CEM, FDM, LDM and QIEM with the weights of their papers; then geometric means, worst
    cases and how many are within 1 % of that best. Energies are compared in one gauge, the
    surface's area centred in the disk, with the surface's own cotangents.
    """
    meshes = [disk_of(one) for one in surfaces]
    measured = [ratios(mesh) for mesh in progress(meshes, "surface")]
    rows = [
        {"surface": mesh.name, "faces": mesh.m}
        | {
            figure: {n: one[n][k] if n in one else None for n in SHOWN.values()}
            for k, figure in enumerate(FIGURES)
        }
        for mesh, one in zip(meshes, measured, strict=True)
    ]
    summary = [
        {"method": name, "weights": weights}
        | {
            figure: standing([one[name + mark][k] for one in measured if name + mark in one])
            for k, figure in enumerate(FIGURES)
        }
        for name in CALLS
        for weights, mark in (("own", ""), ("Delaunay", " D"))
    ]
    how = "Each figure: the geometric mean, the worst, and on how many surfaces it is within 1 %."
    return Section([Table(rows, RATIOS), how, Table(summary, SUMMARY)], "docs/direct_cem.md")


def standing(multiples: Sequence[float]) -> dict[str, float]:
    """Return the geometric mean of some multiples of the best, the worst, and how many are near."""
    x = np.array(multiples)
    return {
        "mean": float(np.exp(np.log(x).mean())),
        "worst": float(x.max()),
        "near": int((x < 1.01).sum()),
    }


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
