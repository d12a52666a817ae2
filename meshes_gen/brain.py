"""A brain hemisphere folded into gyri and sulci, cut at its stem."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .implicit import Body, Noise, bump, cone, ellipsoid, halfspace, join, meet, to_surface


def human_brain_body(seed: int = 0) -> Body:
    """A brain hemisphere, front to the left (-x), flat side away; `seed` sets the folds."""
    folds = Noise(seed + 7, 0.52, waves=40, spread=0.15)
    bends = [Noise(seed + 20 + d, 0.60, waves=12) for d in range(3)]

    def hull(p: Real) -> Real:
        lobe = ellipsoid(p, (0, 0.0, 0.15), (1.35, 0.95, 0.92))
        lobe = join(lobe, ellipsoid(p, (-0.30, -0.50, -0.30), (0.74, 0.38, 0.36)), 0.30)
        lobe = lobe + 0.13 * np.exp(
            -((cone(p, (-0.80, -0.95, -0.10), (0.45, -1.0, 0.30), 0, 0) / 0.17) ** 2)
        )
        lobe = meet(lobe, p[:, 1] - 0.18, 0.40)
        return lobe + 0.12 * bump(p, (0.9, -0.1, -0.75), (0.5, 0.6, 0.4))

    def f(p: Real) -> Real:
        # Folds run along the hull's normals, so none can close over a hollow.
        q = to_surface(hull, p, 0.01, 0.3, rounds=3)
        n = folds(q + 0.08 * np.stack([b(q) for b in bends], axis=1))
        # A groove along every nodal line of the noise; the ridges between them stay round.
        groove = 0.15 * np.exp(-((n / 0.50) ** 2)) - 0.03
        plain = bump(p, (0.60, -0.1, -0.62), (0.62, 0.55, 0.36))  # under the cerebellum
        d = hull(p) + groove * (1 - np.clip(1.5 * plain, 0, 1))
        place = np.array([0.74, -0.26, -0.66])
        axis = (p - place) / (0.50, 0.44, 0.32)
        latitude = axis[:, 2] / np.maximum(np.linalg.norm(axis, axis=1), 0.3)
        leaves = 0.020 * np.cos(22 * latitude) * np.clip(1.6 - 1.6 * np.abs(latitude), 0, 1)
        d = join(d, ellipsoid(p, place, (0.50, 0.44, 0.32)) + leaves, 0.06)
        stem = cone(p, (0.22, -0.06, -0.2), (0.40, -0.02, -1.95), 0.22, 0.165)
        return join(d, stem, 0.12)

    return Body(f, halfspace((0, 0, 1), -1.60), (-1.6, -1.25, -1.8), (1.6, 0.55, 1.3), 210)
