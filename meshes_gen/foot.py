"""A bare left foot with five toes, cut above the ankle."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .implicit import Body, Noise, bump, ellipsoid, halfspace, join, sphere, tube

#: Toes from the big toe on: base, joint, tip (toes point along -y), radii.
TOES = [
    ((-0.20, -0.85, 0.20), (-0.22, -1.18, 0.17), (-0.21, -1.42, 0.135), (0.15, 0.125, 0.12)),
    ((0.00, -0.92, 0.20), (-0.01, -1.24, 0.22), (0.00, -1.42, 0.10), (0.10, 0.085, 0.080)),
    ((0.14, -0.87, 0.18), (0.16, -1.14, 0.20), (0.17, -1.31, 0.09), (0.095, 0.078, 0.074)),
    ((0.27, -0.78, 0.16), (0.31, -1.00, 0.18), (0.33, -1.15, 0.085), (0.09, 0.074, 0.070)),
    ((0.38, -0.66, 0.14), (0.44, -0.84, 0.15), (0.47, -0.97, 0.08), (0.085, 0.072, 0.068)),
]


def foot_body(seed: int = 0) -> Body:
    """A left foot with the shin; `seed` sets the unevenness of the skin."""
    skin, fine = Noise(seed, 0.30), Noise(seed + 1, 0.10)

    def f(p: Real) -> Real:
        d = ellipsoid(p, (0.02, 0.72, 0.25), (0.27, 0.30, 0.26))
        back = [(0.03, 0.60, 0.30), (0.02, 0.0, 0.34), (0.05, -0.62, 0.20)]
        d = join(d, tube(p, back, [0.27, 0.26, 0.20], 0.1), 0.2)
        d = join(d, tube(p, [(-0.17, -0.72, 0.21), (0.33, -0.50, 0.16)], [0.20, 0.15]), 0.2)
        d = join(d, tube(p, [(0.22, 0.4, 0.17), (0.34, -0.5, 0.15)], [0.16, 0.15]), 0.15)
        d = join(d, ellipsoid(p, (0.0, 0.0, 0.48), (0.19, 0.45, 0.22)), 0.25)
        leg = [(0.0, 0.46, 0.45), (0.0, 0.47, 0.95), (0.0, 0.50, 1.6), (0.0, 0.55, 2.7)]
        d = join(d, tube(p, leg, [0.27, 0.225, 0.25, 0.36], 0.15), 0.28)
        d = d + 0.14 * bump(p, (-0.24, 0.02, 0.0), (0.26, 0.40, 0.20))  # the arch
        d = join(d, sphere(p, (-0.22, 0.42, 0.62), 0.085), 0.12)  # ankle bones
        d = join(d, sphere(p, (0.22, 0.46, 0.56), 0.085), 0.12)
        for k, (base, joint, tip, radii) in enumerate(TOES):
            toe = tube(p, [base, joint, tip], radii, 0.02)
            d = join(d, toe, 0.045)
            t, r = np.array(tip), radii[2]
            d = d - 0.02 * bump(p, t + (0, -0.02, 0.9 * r), (0.7 * r, 0.8 * r, 0.5 * r))
            knuckle = (base[0], base[1], base[2] + 0.75 * radii[0])
            cord = [(0.02 + 0.06 * k - 0.1, 0.25, 0.60 - 0.02 * k), knuckle]
            d = join(d, tube(p, cord, 0.015), 0.07)
        return d - 0.004 * skin(p) - 0.0015 * fine(p)

    return Body(f, halfspace((0, 0, -1), -2.25), (-0.65, -1.7, -0.15), (0.75, 1.15, 2.45), 170)
