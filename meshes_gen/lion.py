"""An ornate guardian lion in high relief: a mask with a mane of spiral curls."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .implicit import Body, Noise, bump, carve, cone, ellipsoid, halfspace, join, sphere, tube


def _curl(p: Real, centre: Real, outward: Real, radius: float, hand: int) -> Real:
    """Return a button with a spiral groove, like the curls of a stone lion's mane."""
    q = p - centre
    w = outward / np.linalg.norm(outward)
    u = np.cross(w, (0.2, 0.3, 1.0))
    u /= np.linalg.norm(u)
    a, b = q @ u, q @ np.cross(w, u)
    r, angle = np.hypot(a, b), np.arctan2(b, a)
    spiral = np.cos(hand * angle - 2 * np.pi * 1.9 * r / radius)
    edge = np.clip(1.2 - r / radius, 0, 1)
    return np.linalg.norm(q, axis=1) - radius - 0.16 * radius * spiral * edge


def chinese_lion_body(seed: int = 0) -> Body:
    """A lion's head, cut flat behind the mane; `seed` sets the wear of the stone."""
    wear = Noise(seed + 1, 0.25)
    curls = []
    for ring, (count, reach, back, size) in enumerate(
        [(15, 1.02, -0.02, 0.19), (19, 1.31, 0.12, 0.205), (23, 1.56, 0.36, 0.20)]
    ):
        for k in range(count):
            t = 2 * np.pi * (k + 0.5 * (ring % 2)) / count
            c = np.array([reach * np.sin(t), back, 0.10 + reach * 0.98 * np.cos(t)])
            curls.append(
                (c, np.array([0.55 * np.sin(t), -1.0, 0.55 * np.cos(t)]), size, 1 - 2 * (k % 2))
            )

    def face(p: Real) -> Real:
        d = ellipsoid(p, (0, 0.30, 0.05), (1.02, 0.75, 1.02))
        d = join(d, ellipsoid(p, (0, -0.50, -0.28), (0.52, 0.42, 0.36)), 0.22)
        for s in (-1, 1):
            d = join(d, ellipsoid(p, (0.48 * s, -0.22, 0.32), (0.42, 0.30, 0.34)), 0.15)
            d = join(d, ellipsoid(p, (0.27 * s, -0.80, -0.30), (0.30, 0.24, 0.22)), 0.08)
            arc = [(0.1, -0.62, 0.34), (0.38, -0.58, 0.56), (0.72, -0.34, 0.48), (0.8, -0.25, 0.26)]
            brow = [(x * s, y, z) for x, y, z in arc]
            d = join(d, tube(p, brow, [0.12, 0.16, 0.13, 0.06]), 0.06)
            d = carve(d, ellipsoid(p, (0.38 * s, -0.60, 0.22), (0.21, 0.15, 0.15)), 0.08)
            d = join(d, sphere(p, (0.38 * s, -0.46, 0.21), 0.165), 0.03)
            d = carve(d, sphere(p, (0.38 * s, -0.66, 0.20), 0.055), 0.02)
            d = join(d, ellipsoid(p, (0.66 * s, -0.34, -0.22), (0.24, 0.22, 0.24)), 0.12)
            d = carve(d, ellipsoid(p, (0.12 * s, -1.02, -0.06), (0.07, 0.09, 0.06)), 0.04)
        d = join(d, cone(p, (0, -0.60, 0.32), (0, -0.86, 0.04), 0.13, 0.18), 0.10)
        d = join(d, ellipsoid(p, (0, -0.92, 0.0), (0.25, 0.14, 0.15)), 0.06)
        mouth = [(-0.46, -0.62, -0.62), (0, -1.0, -0.60), (0.46, -0.62, -0.62)]
        d = carve(d, tube(p, mouth, [0.09, 0.14, 0.09]), 0.05)
        d = join(d, ellipsoid(p, (0, -0.58, -0.82), (0.40, 0.32, 0.14)), 0.08)
        for x in (-0.30, 0.30):
            d = join(d, cone(p, (x, -0.82, -0.46), (x, -0.84, -0.66), 0.07, 0.03), 0.02)
        for x in (-0.15, -0.05, 0.05, 0.15):
            d = join(d, box_tooth(p, x), 0.015)
        d = join(d, tube(p, [(0, -0.60, -0.95), (0, -0.66, -1.22)], [0.14, 0.05]), 0.08)
        return d - 0.05 * bump(p, (0, -0.35, 0.85), (0.16, 0.5, 0.2))

    def f(p: Real) -> Real:
        d = face(p)
        d = join(d, ellipsoid(p, (0, 0.75, 0.10), (1.78, 1.0, 1.76)), 0.1)
        for centre, outward, size, hand in curls:
            near = np.linalg.norm(p - centre, axis=1) < 2.2 * size
            if near.any():
                d[near] = join(d[near], _curl(p[near], centre, outward, size, hand), 0.03)
        for s in (-1, 1):
            ear = ellipsoid(p, (0.92 * s, -0.28, 0.80), (0.24, 0.10, 0.26))
            hollow = ellipsoid(p, (0.90 * s, -0.38, 0.80), (0.15, 0.09, 0.17))
            d = join(d, carve(ear, hollow, 0.04), 0.06)
        return d - 0.004 * wear(p)

    return Body(f, halfspace((0, -1, 0), -0.74), (-2.0, -1.25, -2.0), (2.0, 0.95, 2.1), 190)


def box_tooth(p: Real, x: float) -> Real:
    """Return a front tooth under the upper lip."""
    return ellipsoid(p, (x, -0.93, -0.50), (0.045, 0.05, 0.07))
