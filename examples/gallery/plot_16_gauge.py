"""
The conformal energy depends on the gauge
=========================================

Moebius maps of the disk turn a conformal map into another. Angles hardly change, E_C does: so
methods must be compared in one gauge, or by what does not depend on it.
"""

import matplotlib.pyplot as plt

import cembench
from cembench.conformal.metrics import all_metrics

surface = cembench.surface("hemi-ellipsoid", 3_000)
z = cembench.parameterize(surface, "cem").z

# %%
# Move the point p of the disk to its centre: z becomes (z - p) / (1 - conj(p) z).

shifts = [0, 0.2, 0.4, 0.6, 0.8]
found = [all_metrics(surface, (z - p) / (1 - p * z)) for p in shifts]

for name in ("conformal_energy", "common_gauge_energy", "beltrami_area_mean"):
    print(f"{name:22}", *(f"{figures[name]:9.5f}" for figures in found))

# %%

fig, axes = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
for ax, p in zip(axes, shifts[::2], strict=True):
    moved = (z - p) / (1 - p * z)
    ax.triplot(moved.real, moved.imag, surface.F, linewidth=0.3, color="tab:blue")
    ax.set(title=f"p = {p}", aspect="equal", xticks=[], yticks=[])
plt.show()
