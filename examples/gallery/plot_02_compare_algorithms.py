"""
Compare algorithms on one surface
=================================

Map the same surface by several algorithms and see where each changes the angles.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench
from cembench.conformal.metrics import angle_errors

# %%
# Four maps to the disk. Each is checked: a map with a fold, or off the circle, would be an error.

surface = cembench.surface("liu-smile-face-stand-in", 6_000)
names = ["harmonic-circle", "cem", "ldm", "direct-cem"]
results = {name: cembench.parameterize(surface, name) for name in names}

for name, result in results.items():
    figures = result.metrics
    print(
        f"{name:16} mean angle error {figures['angle_error_mean_deg']:.3f} degrees, "
        f"conformal energy {figures['conformal_energy']:.5f}"
    )

# %%
# The angle error in each triangle, the mean over its corners, on one scale.

fig, axes = plt.subplots(1, 4, figsize=(12, 3.4), layout="constrained")
for ax, (name, result) in zip(axes, results.items(), strict=True):
    errors = angle_errors(surface, result.z).reshape(-1, 3).mean(axis=1)
    drawn = ax.tripcolor(*result.uv.T, surface.F, np.abs(errors), vmin=0, vmax=10, cmap="viridis")
    ax.set(title=name, aspect="equal", xticks=[], yticks=[])
fig.colorbar(drawn, ax=axes, label="angle error in degrees", extend="max", shrink=0.8)
plt.show()
