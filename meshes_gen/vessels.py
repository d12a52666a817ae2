"""Vessels: a vase with relief, a square bottle. Both are closed solids, open at the mouth."""

from __future__ import annotations

import numpy as np
import scipy

from cembench.core.arrays import Real

from .implicit import Body, Noise, box, carve, halfspace, join, meet, ring


def revolve(p: Real, profile: Real) -> Real:
    """Return about the distance to a surface of revolution; rows of `profile` are (z, radius)."""
    radius = scipy.interpolate.PchipInterpolator(profile[:, 0], profile[:, 1])
    z = np.clip(p[:, 2], profile[0, 0], profile[-1, 0])
    slope = np.clip(radius.derivative()(z), -3, 3)
    return (np.hypot(p[:, 0], p[:, 1]) - radius(z)) / np.sqrt(1 + slope**2)


_VASE = np.array(
    [[-0.3, 0.52], [0, 0.52], [0.12, 0.54], [0.3, 0.46], [0.6, 0.62], [1.1, 0.92], [1.55, 1.0]]
    + [[1.95, 0.86], [2.3, 0.50], [2.6, 0.33], [2.95, 0.30], [3.2, 0.40], [3.32, 0.52], [3.7, 0.56]]
)


def chinese_vase_body(seed: int = 0) -> Body:
    """A vase with lotus petals round its foot, a carved belly and two dragon-like handles."""
    swirl = Noise(seed + 3, 0.55, waves=20)

    def f(p: Real) -> Real:
        d = revolve(p, _VASE)
        angle, z = np.arctan2(p[:, 1], p[:, 0]), p[:, 2]
        petals = np.abs(np.cos(4 * angle)) ** 0.7
        d = d - 0.10 * petals * np.exp(-(((z - 0.75) / 0.30) ** 4))
        belly = np.exp(-(((z - 1.55) / 0.36) ** 6))
        d = d - 0.06 * np.tanh(4 * swirl(p)) * belly
        for height, out in ((0.12, 0.05), (1.14, 0.06), (1.98, 0.06), (2.62, 0.05)):
            d = d - out * np.exp(-(((z - height) / 0.06) ** 2))
        d = d - 0.045 * np.cos(12 * angle) * np.exp(-(((z - 2.25) / 0.16) ** 4))
        d = meet(d, -z, 0.05)
        for s in (-1, 1):  # lugs on the neck without holes, so the surface stays a disk
            lug = ring(p, (0.36 * s, 0, 2.72), (0, 1, 0), 0.13, 0.085)
            core = np.linalg.norm((p - (0.36 * s, 0, 2.72)) / (1, 0.45, 1), axis=1) - 0.14
            d = join(d, np.minimum(lug, core), 0.05)
        return d

    return Body(f, halfspace((0, 0, -1), -3.3), (-1.25, -1.25, -0.15), (1.25, 1.25, 3.6), 150)


def bourbon_bottle_body(seed: int = 0) -> Body:
    """A square bottle with a panel on each side, round shoulders and a ringed neck."""
    glass = Noise(seed + 5, 1.2)

    def f(p: Real) -> Real:
        z = p[:, 2]
        d = box(p, (0, 0, 1.05), (0.70, 0.52, 1.05), 0.16)
        shoulder = meet(
            (np.hypot(p[:, 0] / 0.72, p[:, 1] / 0.56) - 1) * 0.55 + np.clip(z - 2.0, 0, None) * 0.8,
            np.maximum(z - 2.7, 1.6 - z),
            0.1,
        )
        d = join(d, shoulder, 0.18)
        neck = meet(np.hypot(p[:, 0], p[:, 1]) - 0.19 - 0.02 * np.sin(2 * z), 1.8 - z, 0.05)
        d = join(d, neck, 0.22)
        for height, thick in ((2.72, 0.05), (3.22, 0.06), (3.34, 0.045)):
            d = join(d, ring(p, (0, 0, height), (0, 0, 1), 0.19, thick), 0.05)
        for s in (-1, 1):
            label = box(p, (0, 0.56 * s, 1.0), (0.46, 0.09, 0.66), 0.05)
            d = carve(d, label, 0.05)
            side = box(p, (0.74 * s, 0, 1.0), (0.09, 0.28, 0.66), 0.05)
            d = carve(d, side, 0.05)
        star = np.abs(np.arctan2(p[:, 0], z - 1.0))
        wave = 0.20 + 0.07 * np.cos(5 * star)
        medal = np.hypot(p[:, 0], z - 1.0) - wave
        d = d - 0.05 / (1 + np.exp(np.clip(medal / 0.02, -30, 30))) * (p[:, 1] < 0)
        hollow = np.linalg.norm((p - (0, 0, -0.12)) / (1.0, 0.8, 0.55), axis=1) * 0.55 - 0.2
        d = carve(d, hollow, 0.05)
        return d - 0.004 * glass(p)

    return Body(f, halfspace((0, 0, -1), -3.36), (-0.9, -0.75, -0.15), (0.9, 0.75, 3.6), 170)
