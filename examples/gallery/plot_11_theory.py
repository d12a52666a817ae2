"""
The theory on your surface
==========================

Section 4 of the paper states what CEM's iteration does, under premises. On any surface they can be
checked one by one.
"""

import matplotlib.pyplot as plt
import numpy as np

import cembench

surface = cembench.surface("hemi-ellipsoid", 1_000)
found = cembench.theory(surface, iterations=60)

# %%
# Each check has a figure, and what the figure is.

for check in (*found.premises, *found.statements):
    print(f"{'holds' if check.holds else 'fails':6} {check.name} ({check.source})")

# %%
# The energy of the bare iterations (23) and (30), which nothing stops or steers, above the lowest
# value that any of them reaches; and the spectrum of the matrix K that sets their speed.

fig, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
lowest = min(path.energies.min() for path in found.trajectories.values())
for name, path in found.trajectories.items():
    left.semilogy(path.energies - lowest + 1e-16, label=name)
left.set(xlabel="iteration", ylabel="energy above the lowest", ylim=(1e-9, None))
left.legend()
right.plot(np.sort(found.spectrum)[::-1], ".")
right.set(xlabel="number", ylabel="eigenvalue of K")
plt.show()
