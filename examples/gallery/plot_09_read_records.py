"""
Read records with pandas
========================

A run is a folder of records, and a table of pandas is one call away: a row for each cell, with its
figures, its seconds, and why it is not ok where it is not.
"""

import matplotlib.pyplot as plt

import cembench

sizes = (300, 600, 1_200)
surfaces = [
    cembench.surface("hemi-ellipsoid", faces).renamed(f"ellipsoid-{faces}") for faces in sizes
]
run = cembench.benchmark(surfaces, ["cem", "harmonic-circle"], rounds=1)
table = run.table(full=True)

# %%
# All columns.

print(", ".join(table.columns))

# %%
# Means by algorithm, and anything that is not ok.

columns = ["conformal_energy", "angle_error_mean_deg", "dilatation_max"]
print(table.groupby("algorithm")[columns].mean().round(4))
print("not ok:", len(table[table["status"] != "ok"]))

# %%
# On finer meshes CEM's maps come nearer to conformal as fast as edges shrink; the harmonic map,
# with its boundary laid out by arc length, falls behind.

fig, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
for name, rows in table.sort_values("faces").groupby("algorithm"):
    ax.loglog(rows["faces"], rows["angle_error_mean_deg"], "o-", label=name)
ax.set(xlabel="triangles", ylabel="mean angle error in degrees")
ax.legend()
plt.show()
