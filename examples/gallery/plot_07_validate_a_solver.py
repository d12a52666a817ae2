"""
Validate a solver
=================

``cembench validate`` tells the author of a solver whether it is right, and whether it is better.
Here only the first half is run, on the example that ships: the contract, and the surfaces whose
conformal map is known.
"""

from collections import Counter
from pathlib import Path

import matplotlib.pyplot as plt

import cembench
from cembench.validation.verdict import sentences

# %%
# The solver is ``examples/stop_at_angles.py`` of the repository; this program lies in
# ``examples/gallery`` and is run from there.

solver = Path("../stop_at_angles.py")
small = cembench.surface("hemi-ellipsoid", 600)
found = cembench.validate(solver, surfaces=[small], checks_only=True)

# %%
# The verdict, and what it is made of.

print(*sentences(found))
for finding in found.findings:
    print(f"{'ok' if finding.ok else 'NO':3} {finding.stage:12} {finding.name}: {finding.measured}")

# %%
# How many checks were made in each stage.

counts = Counter(finding.stage for finding in found.findings)
fig, ax = plt.subplots(figsize=(6, 2), layout="constrained")
ax.barh(list(counts), list(counts.values()), color="tab:green" if found.valid else "tab:red")
ax.set(xlabel="checks", title=f"{found.title}: {'valid' if found.valid else 'invalid'}")
plt.show()
