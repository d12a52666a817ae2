"""
Write a solver
==============

A solver is a function from a mesh to a :class:`cembench.Parameterization`, with a decorator that
says what it promises. The mesh is checked; time and quality are measured by others.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import all_metrics

# %%
# This one puts the boundary on the circle with equal angles between its vertices, whatever their
# distances, and fills in the interior harmonically.


@cembench.algorithm("equal-angles", title="Equal angles", target="disk")
def equal_angles(mesh: cembench.DiskMesh) -> cembench.Parameterization:
    """Map the boundary to equal angles and the interior harmonically."""
    f_b = np.exp(2j * np.pi * np.arange(len(mesh.boundary)) / len(mesh.boundary))
    return cembench.Parameterization(harmonic_extension(laplacian(mesh), mesh.boundary, f_b))


# %%
# A decorated function is still a function. Its map is judged like any other.

surface = cembench.surface("hemi-ellipsoid", 2_000)
uv = equal_angles(surface).uv
mine = all_metrics(surface, uv)
others = {name: cembench.parameterize(surface, name).metrics for name in ("harmonic-circle", "cem")}

for name, figures in {"equal-angles": mine, **others}.items():
    print(
        f"{name:16} mean angle error {figures['angle_error_mean_deg']:.3f} degrees, "
        f"folded triangles {figures['flipped_triangles']}"
    )

# %%

fig, axes = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
maps = {"equal angles": uv, "CEM": cembench.parameterize(surface, "cem").z}
for ax, (title, z) in zip(axes, maps.items(), strict=True):
    ax.triplot(z.real, z.imag, surface.F, linewidth=0.4)
    ax.set(title=title, aspect="equal", xticks=[], yticks=[])
plt.show()

# %%
# In a file of its own, ``mine.py``, it can be measured by ``cembench run --plugin mine.py`` and
# judged by ``cembench validate mine.py``.
