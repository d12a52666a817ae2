"""Beads on a ring, and how fast two methods let them slide into place."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.measuring import png
from benchmarks.pages import Section

mpl.use("Agg")
import matplotlib.pyplot as plt

#: Energies are drawn down to here.
FLOOR = 1e-12
ARROW = {"arrowstyle": "-", "color": "tab:red", "lw": 0.6, "alpha": 0.7}


def direct_cem_picture() -> Section:
    """Draw beads on a ring, and how fast two methods let them slide into place."""
    mesh = hemi_ellipsoid(3000, x=2.5)
    weights = {"delaunay": False}  # as CEM has them
    start = direct_cem(mesh, max_iterations=0, **weights)
    end = direct_cem(mesh, back=0, **weights)
    by_length = np.exp(2j * np.pi * travelled(mesh.V[mesh.boundary]))
    figure, (ring, fall) = plt.subplots(1, 2, figsize=(9, 4.2), width_ratios=[1, 1.15])

    uv = end.uv
    ring.triplot(uv.real, uv.imag, mesh.F, lw=0.25, color="0.75")
    b = uv[mesh.boundary]
    by_length = by_length * np.exp(-1j * np.angle(np.vdot(b, by_length)))
    ring.plot(b.real, b.imag, "o", ms=2.5, color="tab:blue", label="where they end")
    for p, q in zip(1.12 * by_length[::3], 1.02 * b[::3], strict=True):
        ring.annotate("", (q.real, q.imag), (p.real, p.imag), arrowprops=ARROW)
    outside = 1.12 * by_length
    ring.plot(outside.real, outside.imag, ".", ms=2, color="tab:red", label="by arc length")
    ring.set_aspect("equal")
    ring.axis("off")
    ring.legend(loc="upper center", bbox_to_anchor=(0.5, 0.04), ncols=2, frameon=False, fontsize=8)
    ring.set_title("Boundary vertices are beads on a ring", fontsize=10)

    slow = cem(mesh, tolerance=0, max_iterations=200, stop="change")
    least = min(*end.energy_history, *slow.energy_history)
    fall.semilogy(np.array(slow.energy_history) - least + FLOOR, color="tab:orange", label="CEM")
    newton = np.array(end.energy_history) - least + FLOOR
    fall.semilogy(newton, "o-", ms=4, color="tab:blue", label="Direct CEM")
    fall.set_xlim(-2, 60)
    fall.set_xlabel("iterations")
    fall.set_title("$E_C$ above the least value found", fontsize=10)
    fall.legend(frameon=False)
    fall.grid(alpha=0.3)
    figure.tight_layout()
    ends = f"start {start.energy_history[0]:.6f}, end {end.energy_history[-1]:.6f}"
    return Section([ends], files={"docs/direct_cem.png": png(figure, dpi=140)})


def travelled(loop: np.ndarray) -> np.ndarray:
    """What share of the way round a closed polygon has been gone at each corner?"""
    lengths = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    return (np.cumsum(lengths) - lengths) / lengths.sum()
