"""A cowboy hat with a creased crown and a brim that curls up at the sides."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .implicit import Body, bump, join, meet


def cowboy_hat_body(seed: int = 0) -> Body:
    """A cowboy hat without its underside; `seed` only turns the creases slightly."""
    tilt = 0.02 * np.sin(seed)

    def above_the_brim(x: Real, y: Real, z: Real) -> Real:
        # The sides rise steeply, front and back dip.
        return z - 0.93 * np.clip(np.abs(x) - 0.62, 0, None) ** 1.6 + 0.10 * (y / 1.6) ** 2

    def brim(p: Real) -> Real:
        x, y, z = p.T
        r = np.hypot(x / 1.35, y / 1.65)
        slope = 1 + 0.9 * np.clip(np.abs(x) - 0.6, 0, 1)
        slab = np.abs(above_the_brim(x, y, z)) / slope - 0.075
        return meet(slab, (r - 1) * 1.3, 0.06)

    def crown(p: Real) -> Real:
        x, y, z = p.T
        narrow = 1 - 0.16 * z
        side = (np.hypot(x / (0.66 * narrow), y / (0.84 * narrow)) - 1) * 0.62
        top = z - (0.95 + 0.12 * np.cos(1.5 * y) - 0.05 * y)
        d = meet(meet(side, top, 0.22), -z, 0.05)
        d = d + 0.27 * np.exp(-(((x - tilt) / 0.17) ** 2) - ((y / 0.62) ** 4)) * np.clip(z, 0, 1)
        for s in (-1, 1):
            d = d + 0.17 * bump(p, (0.52 * s, -0.48, 0.82), (0.28, 0.34, 0.42))
        return d

    def f(p: Real) -> Real:
        d = join(brim(p), crown(p), 0.10)
        x, y, z = p.T
        band = np.exp(-(((z - 0.16) / 0.07) ** 4)) * (np.hypot(x, y) < 1.0)
        return d - 0.028 * band

    def keep(p: Real) -> Real:
        x, y, z = p.T
        return np.minimum(above_the_brim(x, y, z), 0.93 - np.hypot(x / 1.35, y / 1.65))

    return Body(f, keep, (-1.6, -1.85, -0.55), (1.6, 1.85, 1.4), 150)
