"""
Plot your own figure
====================

A result is arrays. Here: how much the map scales the surface at each vertex, and how far it is
from conformal in each triangle, as functions on the disk.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.metrics import surface_areas

surface = cembench.surface("hemi-ellipsoid", 4_000)
result = cembench.parameterize(surface, "cem")

# %%
# The conformal factor is the scale of the map. For a triangle: half the logarithm of its area on
# the disk over its area on the surface.

a, b, c = result.z[surface.F].T
image = 0.5 * (np.conj(b - a) * (c - a)).imag
factor = 0.5 * np.log(image / surface_areas(surface))

# %%
# The Beltrami coefficient is zero where the map is conformal.

mu = np.abs(beltrami_coefficients(result.z, surface.F, surface.V))
print(f"largest |mu| {mu.max():.3f}; mean over triangles {mu.mean():.4f}")

# %%

fig, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for ax, values, title in (
    (axes[0], factor, "logarithm of the conformal factor"),
    (axes[1], mu, "modulus of the Beltrami coefficient"),
):
    drawn = ax.tripcolor(*result.uv.T, surface.F, values, cmap="magma")
    ax.set(title=title, aspect="equal", xticks=[], yticks=[])
    fig.colorbar(drawn, ax=ax, shrink=0.8)
plt.show()
