"""A left hand with five fingers, cut at the wrist."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .implicit import Body, Noise, box, bump, cone, ellipsoid, halfspace, join, tube

#: Knuckle, middle joint, last joint and tip of each finger; palm towards -y, fingers up.
FINGERS = {
    "index": [(0.34, 0.02, 0.62), (0.42, -0.06, 1.10), (0.45, -0.16, 1.40), (0.46, -0.26, 1.62)],
    "middle": [(0.11, 0.04, 0.70), (0.13, -0.03, 1.24), (0.14, -0.12, 1.58), (0.14, -0.22, 1.83)],
    "ring": [(-0.12, 0.04, 0.66), (-0.17, -0.04, 1.16), (-0.20, -0.14, 1.48), (-0.21, -0.24, 1.72)],
    "little": [
        (-0.33, 0.01, 0.55),
        (-0.45, -0.06, 0.92),
        (-0.51, -0.15, 1.15),
        (-0.53, -0.23, 1.34),
    ],
    "thumb": [(0.28, -0.08, -0.02), (0.58, -0.20, 0.28), (0.72, -0.28, 0.55), (0.76, -0.34, 0.76)],
}
RADII = {
    "index": [0.125, 0.108, 0.094, 0.078],
    "middle": [0.128, 0.112, 0.097, 0.080],
    "ring": [0.125, 0.105, 0.091, 0.075],
    "little": [0.110, 0.090, 0.077, 0.064],
    "thumb": [0.19, 0.135, 0.118, 0.09],
}


def left_hand_body(seed: int = 0) -> Body:
    """A left hand; `seed` sets the unevenness of the skin."""
    broad, fine = Noise(seed, 0.35), Noise(seed + 1, 0.09)

    def f(p: Real) -> Real:
        d = box(p, (0, 0, 0.22), (0.42, 0.15, 0.46), 0.14)
        d = join(d, ellipsoid(p, (0.22, -0.10, 0.05), (0.20, 0.15, 0.30)), 0.12)
        d = join(d, ellipsoid(p, (-0.25, -0.08, 0.05), (0.16, 0.13, 0.33)), 0.12)
        arm = [(0, 0.0, -0.1), (0, 0.02, -0.7), (0, 0.02, -1.5)]
        d = join(d, tube(p, arm, [0.29, 0.23, 0.28]), 0.2)
        for name, joints in FINGERS.items():
            finger = tube(p, joints, RADII[name], 0.02)
            d = join(d, finger, 0.05 if name != "thumb" else 0.12)
        for name, joints in FINGERS.items():
            a, tip, r = np.array(joints[2]), np.array(joints[3]), RADII[name][3]
            along = (tip - a) / np.linalg.norm(tip - a)
            back = np.array([0, 1, 0]) - along * along[1]
            nail = tip - 0.02 * along + 0.95 * r * back / np.linalg.norm(back)
            d = d - 0.010 * bump(p, nail, 0.055)
            for joint in joints[1:3]:  # creases on the palm side, folds on the back
                j = np.array(joint)
                d = d + 0.010 * bump(p, j + (0, -0.11, 0), (0.10, 0.06, 0.022))
                d = d - 0.014 * bump(p, j + (0, 0.10, 0), (0.06, 0.06, 0.05))
        for x, name in ((0.34, "index"), (0.11, "middle"), (-0.12, "ring"), (-0.33, "little")):
            k = np.array(FINGERS[name][0])
            d = d - 0.035 * bump(p, k + (0, 0.12, 0), (0.09, 0.1, 0.09))
            tendon = cone(p, (0.3 * x, 0.14, -0.15), k + (0, 0.11, -0.05), 0.02, 0.025)
            d = join(d, tendon, 0.06)
        for start, end in (
            ((0.34, -0.16, 0.30), (-0.30, -0.16, 0.42)),
            ((0.05, -0.2, -0.15), (0.3, -0.16, 0.36)),
        ):
            d = d + 0.02 * np.exp(-((cone(p, start, end, 0.0, 0.0) / 0.035) ** 2))
        return d - 0.004 * broad(p) - 0.001 * fine(p)

    return Body(f, halfspace((0, 0, 1), -0.92), (-0.85, -0.62, -1.1), (1.05, 0.45, 2.05), 190)
