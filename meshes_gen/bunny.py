"""A sitting bunny with long ears, cut at its base."""

from __future__ import annotations

from cembench.core.arrays import Real

from .implicit import Body, Noise, bump, carve, ellipsoid, halfspace, join, rotation, sphere, tube


def stanford_bunny_body(seed: int = 0) -> Body:
    """A sitting bunny, facing left (-x); `seed` sets its fur."""
    lumps, fur = Noise(seed, 0.34, waves=24), Noise(seed + 1, 0.14, waves=24)

    def f(p: Real) -> Real:
        d = ellipsoid(p, (0.28, 0, 0.62), (0.80, 0.62, 0.66))
        d = join(d, ellipsoid(p, (0.05, 0, 0.05), (0.98, 0.60, 0.16)), 0.10)
        d = join(d, ellipsoid(p, (-0.30, 0, 0.72), (0.46, 0.46, 0.60)), 0.25)
        d = join(d, ellipsoid(p, (-0.62, 0, 1.28), (0.44, 0.32, 0.33), rotation("y", -18)), 0.14)
        d = join(d, ellipsoid(p, (-0.93, 0, 1.17), (0.20, 0.20, 0.17)), 0.15)
        d = join(d, sphere(p, (-1.10, 0, 1.20), 0.05), 0.05)
        d = join(d, sphere(p, (1.06, 0.02, 0.42), 0.24), 0.06)
        for s in (-1, 1):
            d = join(d, sphere(p, (-0.92, 0.11 * s, 1.10), 0.12), 0.08)
            haunch = ellipsoid(p, (0.45, 0.46 * s, 0.46), (0.48, 0.26, 0.46))
            d = join(d, haunch, 0.07)
            hind = [(0.45, 0.58 * s, 0.10), (-0.10, 0.56 * s, 0.09)]
            d = join(d, tube(p, hind, [0.16, 0.12]), 0.06)
            fore = [(-0.40, 0.26 * s, 0.5), (-0.70, 0.26 * s, 0.10), (-0.88, 0.26 * s, 0.09)]
            d = join(d, tube(p, fore, [0.2, 0.12, 0.11], 0.03), 0.08)
            ends = [(-0.5, 0.15, 1.5), (-0.3, 0.22, 1.95), (-0.06, 0.32, 2.4), (0.1, 0.38, 2.66)]
            ear = [(x, y * s, z) for x, y, z in ends]
            d = join(d, tube(p, ear, [0.12, 0.16, 0.15, 0.07], 0.06), 0.07)
            hollow = [
                (-0.45, 0.22 * s - 0.02 * s, 1.72),
                (-0.26, 0.32 * s, 2.05),
                (-0.10, 0.42 * s, 2.40),
            ]
            hollow = [(x - 0.09, y + 0.03 * s, z) for x, y, z in hollow]
            d = carve(d, tube(p, hollow, [0.05, 0.075, 0.05]), 0.05)
            d = carve(d, sphere(p, (-0.80, 0.31 * s, 1.36), 0.085), 0.05)
            d = join(d, sphere(p, (-0.80, 0.265 * s, 1.36), 0.075), 0.015)
        d = d + 0.07 * bump(p, (-1.08, 0, 1.08), (0.2, 0.025, 0.1))
        return d - 0.008 * lumps(p) - 0.0035 * fur(p)

    return Body(f, halfspace((0, 0, 1), 0.08), (-1.35, -0.95, -0.25), (1.45, 0.95, 2.85), 170)
