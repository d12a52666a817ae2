"""
A geometry image, and a new mesh
================================

Through its map a surface can be sampled on a regular grid, as an image whose colours are
coordinates, or meshed anew with triangles that are equilateral on the disk.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench

surface = cembench.surface("hemi-ellipsoid", 4_000)
result = cembench.parameterize(surface, target="disk")

# %%
# 129 samples along each side; the disk is mapped to the square conformally.

image = result.geometry_image(129)
low, high = image.min(axis=(0, 1)), image.max(axis=(0, 1))

fig, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
axes[0].imshow((image - low) / (high - low))
axes[0].set(title="coordinates as colours", xticks=[], yticks=[])
normals = np.cross(np.gradient(image, axis=1), np.gradient(image, axis=0))
normals /= np.linalg.norm(normals, axis=2, keepdims=True)
axes[1].imshow(0.5 + 0.5 * normals)
axes[1].set(title="normals", xticks=[], yticks=[])
plt.show()

# %%
# The same surface with other triangles.

other = result.remesh(41)
print(f"{surface.m:,} triangles before, {other.m:,} after")
fig, ax = plt.subplots(figsize=(5, 4), subplot_kw={"projection": "3d"})
ax.plot_trisurf(*other.V.T, triangles=other.F, color="white", edgecolor="grey", linewidth=0.3)
ax.set_box_aspect(np.ptp(other.V, axis=0), zoom=1.4)
ax.set_axis_off()
plt.show()
