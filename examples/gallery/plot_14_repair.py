"""
Repair a triangle soup
======================

Triangles of a file often share no vertices, lie there twice, or face the wrong way. A repair makes
a surface of them and counts every step.
"""

import numpy as np

import cembench

# %%
# Spoil a clean surface: every triangle gets vertices of its own, one in ten is turned over, and
# the first fifty come twice.

clean = cembench.surface("spherical-cap", 1_500)
rng = np.random.default_rng(0)
V, F = clean.V[clean.F].reshape(-1, 3), np.arange(3 * clean.m).reshape(-1, 3)
turned = rng.random(clean.m) < 0.1
F[turned] = F[turned][:, ::-1]
F = np.concatenate([F, F[:50]])

# %%
# Such a surface is refused, and the message says what to do.

try:
    cembench.parameterize((V, F))
except cembench.MeshError as error:
    print(error)

# %%

mended = cembench.repair((V, F))
for step, times in mended.steps.items():
    if times:
        print(f"{times:6,} {step}")
result = cembench.parameterize(mended.mesh)
figure = result.plot()
