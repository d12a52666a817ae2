"""
Morph one surface into another
==============================

Two surfaces are mapped to the disk, the maps are matched at landmarks, and the vertices of the
first move through both (Section 6 of the paper).
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench

first = cembench.surface("hemi-ellipsoid", 2_000)
second = cembench.surface("spherical-cap", 2_000, angle=120.0)

# %%
# Landmarks are vertices that correspond, inside the surfaces. Here they are the highest point of
# each, and the points half way down to the right and to the left.


def landmarks_of(mesh):
    """Return the vertices nearest to the top, and to two points half way down."""
    size = mesh.V.max(axis=0) * [1, 0, 1]
    z = 0.5 * (mesh.V[:, 2].max() + mesh.V[:, 2].min())
    places = {"top": mesh.V[mesh.V[:, 2].argmax()]}
    places |= {"right": [0.8 * size[0], 0, z], "left": [-0.8 * size[0], 0, z]}
    return {name: np.linalg.norm(mesh.V - at, axis=1).argmin() for name, at in places.items()}


ours, theirs = landmarks_of(first), landmarks_of(second)
landmarks = {name: (ours[name], theirs[name]) for name in ours}
path = cembench.morph([first, second], landmarks)

# %%
# The path at five moments. Every moment is a mesh with the triangles of the first.

fig, axes = plt.subplots(1, 5, figsize=(12, 3), subplot_kw={"projection": "3d"})
for ax, time in zip(axes, np.linspace(0, 1, 5), strict=True):
    V = path.at(time)
    ax.plot_trisurf(*V.T, triangles=first.F, color="tan", linewidth=0, antialiased=False)
    ax.set_title(f"t = {time:.2f}")
    ax.set_box_aspect(np.ptp(V, axis=0), zoom=1.5)
    ax.set_axis_off()
plt.show()
