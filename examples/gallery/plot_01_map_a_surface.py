"""
Map a surface
=============

Map a surface to the plane, look at it under a checkerboard, and read the figures.
"""

import cembench

# %%
# A surface is a file, a pair of arrays, or the name of a family that can be made. This one is half
# an ellipsoid. The algorithm need not be named: the default is the map with the smallest angle
# errors that neither folds nor overlaps. ``target="disk"`` maps to the unit disk instead.

surface = cembench.surface("hemi-ellipsoid", 4_000)
result = cembench.parameterize(surface)
result

# %%
# The same as arrays. ``uv`` has a row for each vertex; figures go by name.

print("uv:", result.uv.shape, result.uv.dtype)
print("folded triangles:", result.metrics["flipped_triangles"])
print(f"mean angle error: {result.metrics['angle_error_mean_deg']:.3f} degrees")

# %%
# The picture can be had as a figure of matplotlib.

figure = result.plot()
