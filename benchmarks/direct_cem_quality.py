"""Direct CEM beside the other disk maps, each with its own weights and with Delaunay weights.

    python benchmarks/direct_cem_quality.py face.obj head.ply ...

prints Markdown: for every surface the mean angle error, the mean of |mu| over the surface's area
and the conformal energy of each method, as multiples of the best of CEM, FDM, LDM and QIEM with the
weights of their papers; then geometric means, worst cases and how many are within 1 %. Methods
with intrinsic Delaunay weights are marked D. Energies are compared in one gauge, the surface's area
centred in the disk, with the surface's own cotangents.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.fdm import fdm
from cembench.algorithms.ldm import ldm
from cembench.algorithms.qiem import qiem
from numpy.typing import NDArray

from cembench import AlgorithmFailed, DiskMesh, Parameterization
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.metrics import angle_errors, dirichlet_energy, flipped_triangles, image_area
from cembench.mesh.files import read_mesh
from cembench.workflows.morphing.align import to_centre

PAPER = ("CEM", "FDM", "LDM", "QIEM")
FIGURES = ("angle", "mu", "energy")

Method = Callable[[DiskMesh], Parameterization]


def methods() -> dict[str, Method]:
    """Return every method that is compared, by name."""
    found: dict[str, Method] = {}
    for suffix, delaunay in (("", False), (" D", True)):
        for name, function in zip(PAPER, (cem, fdm, ldm, qiem), strict=True):
            found[name + suffix] = _with(function, delaunay=delaunay)
        slow = {"max_iterations": 200, "tolerance": 0, "stop": "change"}
        found["CEM 200" + suffix] = _with(cem, delaunay=delaunay, **slow)
        found["direct" + suffix] = _with(direct_cem, delaunay=delaunay)
        found["direct, back=0" + suffix] = _with(direct_cem, delaunay=delaunay, back=0)
    return found


def _with(function: Method, **parameters: float | str) -> Method:
    return lambda mesh: function(mesh, **parameters)


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
    for name, method in methods().items():
        try:
            uv = method(mesh.fresh()).uv
        except AlgorithmFailed:
            continue
        if not flipped_triangles(mesh, uv):
            measured[name] = np.array(figures(mesh, uv))
    best = np.min([measured[name] for name in PAPER if name in measured], axis=0)
    return {name: values / best for name, values in measured.items()}


def main(files: list[str]) -> None:
    """Print the tables."""
    names = [name for name in methods() if name not in PAPER]
    every: dict[str, list[NDArray[np.float64]]] = {name: [] for name in methods()}
    print("| surface | figure |", " | ".join(names), "|\n|---|---|" + "---:|" * len(names))
    for file in files:
        surface = read_mesh(Path(file))
        found = ratios(DiskMesh.from_arrays(surface.V, surface.F))
        for name, values in found.items():
            every[name].append(values)
        for k, figure in enumerate(FIGURES):
            cells = [f"{found[name][k]:.3f}" if name in found else "-" for name in names]
            print(f"| {Path(file).stem} | {figure} |", " | ".join(cells), "|", flush=True)
    print("\n| method | figure | surfaces | geometric mean | worst | within 1 % |")
    print("|---|---|---:|---:|---:|---:|")
    for name, rows in every.items():
        for k, figure in enumerate(FIGURES):
            x = np.array(rows)[:, k]
            mean, near = np.exp(np.log(x).mean()), (x < 1.01).sum()
            print(f"| {name} | {figure} | {len(x)} | {mean:.3f} | {x.max():.3f} | {near} |")


if __name__ == "__main__":
    main(sys.argv[1:])
