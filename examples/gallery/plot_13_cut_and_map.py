"""
Cut a closed surface and map it
===============================

A torus is no disk. It is cut open along two short curves, and the disk that comes of it is mapped.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench

# %%
# A torus as two arrays: a grid that closes in both directions.

n, m = 48, 24
i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
u, v = 2 * np.pi * i / n, 2 * np.pi * j / m
V = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1)
a, b = i * m + j, (i + 1) % n * m + j
c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
F = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
V = V.reshape(-1, 3)

# %%
# The cut duplicates the vertices along it; ``origin`` tells of which vertex each is a copy.

opened = cembench.cut((V, F))
disk = opened.mesh
print(f"{len(V)} vertices before the cut, {disk.n} after it; {len(opened.edges)} edges are cut")
result = cembench.parameterize(disk)
figure = result.plot()

# %%
# Where the cut runs, on the torus and in the plane.

fig = plt.figure(figsize=(9, 4))
left = fig.add_subplot(1, 2, 1, projection="3d")
left.plot_trisurf(*V.T, triangles=F, color="lightgrey", alpha=0.4)
for edge in opened.edges:
    left.plot(*V[edge].T, color="tab:red")
left.set_box_aspect(np.ptp(V, axis=0), zoom=1.35)
left.set_axis_off()
right = fig.add_subplot(1, 2, 2, aspect="equal")
right.triplot(*result.uv.T, disk.F, color="lightgrey", linewidth=0.5)
right.plot(*result.uv[np.append(disk.boundary, disk.boundary[0])].T, color="tab:red")
right.set_axis_off()
plt.show()
