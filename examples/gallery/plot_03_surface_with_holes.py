"""
A surface with holes
====================

With ``target="circular holes"`` a surface with several boundary loops goes to a disk with round
holes. The outer loop is the widest one unless you name a vertex of another.
"""

import cembench

surface = cembench.surface("holed-cap", 3_000, holes=3)
print("vertices on the boundary loops:", [len(loop) for loop in surface.loops])

# %%
# The algorithm recommended for this target moves centres and radii of the holes until the energy
# is least.

result = cembench.parameterize(surface, target="circular holes")
figure = result.plot()

# %%
# :func:`cembench.holes` takes every algorithm that can do it, and one that fills the holes and maps
# the disk, so that they come out as they may; the figure tells how far from circles.

for name, found in cembench.holes(surface).items():
    figures = found.metrics
    print(
        f"{name:18} mean angle error {figures['angle_error_mean_deg']:.3f} degrees, "
        f"boundaries off their circles by {figures['boundary_circularity']:.1e} of the radius"
    )
