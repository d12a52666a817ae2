"""
Transfer a texture
==================

Colours of one surface are carried to another through the two disks. Both maps are conformal, so
small squares stay nearly squares on the way.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench
from cembench.conformal.resample import locate

source = cembench.surface("spherical-cap", 12_000, angle=100.0)
target = cembench.surface("hemi-ellipsoid", 12_000, x=1.0, y=1.0, z=1.8)
from_source, from_target = (cembench.parameterize(one, target="disk") for one in (source, target))

# %%
# The texture of the source: rings about its top, and sectors.

x, y, z = source.V.T
colours = np.sign(np.sin(6 * np.arccos(z / np.abs(z).max())) * np.sin(8 * np.arctan2(y, x)))

# %%
# For each vertex of the target: in which triangle of the source's disk does it lie, and with which
# barycentric coordinates? The colour is looked up there.

face, weights = locate(from_source.z, source.F, from_target.z, nearest=True)
carried = (colours[source.F[face]] * weights).sum(axis=1)

# %%

fig, axes = plt.subplots(1, 2, figsize=(9, 4.2), subplot_kw={"projection": "3d"})
for ax, mesh, values, title in (
    (axes[0], source, colours, "source"),
    (axes[1], target, carried, "target"),
):
    drawn = ax.plot_trisurf(
        *mesh.V.T, triangles=mesh.F, cmap="PuOr", linewidth=0, antialiased=False, shade=False
    )
    drawn.set_array(values[mesh.F].mean(axis=1))
    drawn.set_clim(-1.3, 1.3)
    ax.set_title(title)
    ax.set_box_aspect(np.ptp(mesh.V, axis=0), zoom=1.4)
    ax.view_init(elev=50)
    ax.set_axis_off()
plt.show()
