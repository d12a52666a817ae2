"""
An external program
===================

A program of any language is an algorithm once it is declared: its command, and what it writes. This
one is forty lines of Python that know nothing of cembench; it could be C, or MATLAB.
"""

from pathlib import Path

import cembench

# %%
# It lies in ``examples/external`` of the repository, with the file that declares it; the program
# here is run from ``examples/gallery``.

folder = Path("../external")
print((folder / "tutte_program.py").read_text(encoding="utf-8"))

# %%
# The harness writes the mesh, runs the program, reads its UVs, and judges them as any others.

surface = cembench.surface("hemi-ellipsoid", 1_000)
plugin = str(folder / "tutte_program.py")
result = cembench.parameterize(surface, "tutte-program", plugins=[plugin])
figure = result.plot()

# %%
# Tutte's map never folds, and is not conformal: the angles tell.

for one in (result, cembench.parameterize(surface, "cem")):
    error = one.metrics["angle_error_mean_deg"]
    print(f"{one.algorithm.title:24} mean angle error {error:.2f} degrees")
