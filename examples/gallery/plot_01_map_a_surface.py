"""
Map a surface
=============

Map a surface to the plane, look at it under a checkerboard, and read the figures.
"""

import cembench

# %%
# A surface is a file, a pair of arrays, or the name of a surface that can be made. This one is a
# generated face, a stand-in for a scan. The algorithm need not be named: the default is the map
# with the smallest angle errors that neither folds nor overlaps. Here it is named, so that the face
# goes to the disk.

surface = cembench.surface("liu-smile-face-stand-in", 6_000)
result = cembench.parameterize(surface, "direct-cem")
result

# %%
# The same as arrays. ``uv`` has a row for each vertex; figures go by name.

print("uv:", result.uv.shape, result.uv.dtype)
print("folded triangles:", result.metrics["flipped_triangles"])
print(f"mean angle error: {result.metrics['angle_error_mean_deg']:.3f} degrees")

# %%
# The picture can be had as a figure of matplotlib.

figure = result.plot()
