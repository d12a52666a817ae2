"""
Benchmark a folder of meshes
============================

Measure algorithms on all meshes of a folder. Each pair is a cell: it runs in processes of its own,
in rounds, and its records stay on disk, so that an interrupted run goes on where it was.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import cembench

# %%
# A folder with two small meshes, as you may have one.

scratch = tempfile.TemporaryDirectory()
folder = Path(scratch.name)
for name in ("hemi-ellipsoid", "cone"):
    cembench.write_mesh(folder / f"{name}.obj", cembench.surface(name, 800))
meshes = sorted(folder.glob("*.obj"))

# %%
# One round is enough to see how it goes. For figures with a 95 % interval leave ``rounds`` out:
# then cells are measured until they are known to 5 %.

run = cembench.benchmark(meshes, ["cem", "lscm"], rounds=1, output=folder / "run")
run.table()[["surface", "algorithm", "status", "angle°", "folds"]]

# %%
# The second call measures nothing: everything is there.

again = cembench.benchmark(meshes, ["cem", "lscm"], rounds=1, output=folder / "run")
print(len(again.records()), "records in", again.folder.name)

# %%

table = run.table().pivot(index="surface", columns="algorithm", values="angle°")
table.plot.bar(rot=0, ylabel="mean angle error in degrees", figsize=(6, 3.2))
plt.show()
