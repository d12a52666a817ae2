"""Whole figures: a robed one with a torch, a seated one with a child."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .head import NEUTRAL, Head, Person
from .implicit import Body, Noise, box, cone, ellipsoid, halfspace, join, meet, ring, sphere, tube


def _placed(head: Head, p: Real, at: tuple[float, float, float], scale: float) -> Real:
    """Return a head scaled and moved to another place."""
    q = (p - np.asarray(at)) / scale
    far = np.linalg.norm(q - (0, 0.1, -0.2), axis=1) - 1.9
    d = far * scale + 0.3 * scale
    near = far < 0
    if near.any():
        d[near] = scale * head(q[near])
    return d


def statue_of_liberty_body(seed: int = 0) -> Body:
    """A robed woman: torch raised in the right hand, tablet in the left arm, crown with rays."""
    head = Head(Person(jaw=0.98, nose=1.0), NEUTRAL, ears=False, neck=False)
    folds = Noise(seed + 4, 1.3)
    flame = Noise(seed + 6, 0.22)

    def robe(p: Real) -> Real:
        x, y, z = p.T
        height = np.clip(z, 0, 4.4)
        rx = np.interp(
            height, [0, 1.2, 2.4, 3.1, 3.7, 4.1, 4.4], [0.98, 0.84, 0.70, 0.64, 0.74, 0.62, 0.30]
        )
        ry = np.interp(
            height, [0, 1.2, 2.4, 3.1, 3.7, 4.1, 4.4], [0.80, 0.68, 0.54, 0.47, 0.46, 0.40, 0.26]
        )
        d = (np.hypot(x / rx, y / ry) - 1) * ry
        angle = np.arctan2(x, -y)
        low = np.clip((3.0 - z) / 1.2, 0, 1)
        pleats = np.cos(15 * angle + 1.3 * folds(p))
        d = d - 0.06 * low * pleats
        # The stola: slanting folds over the chest and the hips.
        sash = np.cos(9.0 * (z + 0.75 * x) + 0.8 * folds(p))
        d = d - 0.045 * sash * np.clip((z - 2.3) / 0.4, 0, 1) * np.clip((4.2 - z) / 0.4, 0, 1)
        hem = z - 1.55 + 0.9 * x
        d = d - 0.07 / (1 + np.exp(-np.clip(hem / 0.05, -30, 30))) * np.clip((3.2 - z), 0, 1)
        return meet(d, z - 4.35, 0.25) * 0.8

    def f(p: Real) -> Real:
        d = robe(p)
        d = join(d, tube(p, [(0, 0.02, 4.0), (0, 0.0, 4.7)], [0.24, 0.19]), 0.2)
        d = join(d, _placed(head, p, (0, -0.02, 4.98), 0.40), 0.08)
        hair = ellipsoid(p, (0, 0.14, 5.06), (0.36, 0.40, 0.37))
        d = join(d, hair - 0.012 * np.cos(40 * p[:, 2] + 9 * p[:, 0]), 0.04)
        crown = ring(p, (0, -0.02, 5.24), (0, -0.25, 1), 0.33, 0.055)
        d = join(d, crown, 0.03)
        for turn in np.deg2rad([-60, -40, -20, 0, 20, 40, 60]):
            out = np.array([np.sin(turn), -0.10, np.cos(turn)])
            a = np.array([0.0, -0.02, 5.14]) + 0.06 * out
            d = join(d, cone(p, a, a + 0.66 * out, 0.055, 0.030), 0.03)
        arm = [(-0.55, 0.0, 3.95), (-0.88, -0.06, 4.75), (-0.98, -0.10, 5.55)]
        d = join(d, tube(p, arm, [0.22, 0.16, 0.115], 0.05), 0.14)
        d = join(d, sphere(p, (-0.45, 0.0, 4.10), 0.32), 0.15)
        sleeve = cone(p, (-0.58, 0, 3.9), (-0.82, -0.04, 4.55), 0.27, 0.22)
        d = join(d, sleeve - 0.018 * np.cos(24 * p[:, 2] + 6 * p[:, 0]), 0.06)
        d = join(d, sphere(p, (-0.99, -0.11, 5.62), 0.135), 0.05)
        d = join(d, cone(p, (-0.98, -0.10, 5.35), (-1.02, -0.12, 5.95), 0.06, 0.10), 0.03)
        gallery = meet(
            np.hypot(p[:, 0] + 1.02, p[:, 1] + 0.12) - 0.25, np.abs(p[:, 2] - 6.0) - 0.06, 0.03
        )
        d = join(d, gallery, 0.04)
        fire = cone(p, (-1.02, -0.12, 6.12), (-1.0, -0.12, 6.55), 0.17, 0.03)
        d = join(d, fire - 0.035 * flame(p), 0.04)
        left = [(0.58, 0.0, 3.85), (0.80, -0.10, 3.15), (0.62, -0.50, 3.02)]
        d = join(d, tube(p, left, [0.23, 0.19, 0.13], 0.05), 0.12)
        d = join(d, ellipsoid(p, (0.56, -0.20, 3.30), (0.30, 0.34, 0.55)), 0.10)
        turn = np.deg2rad(14)
        q = (p - (0.70, -0.42, 3.36)) @ np.array(
            [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
        )
        d = join(d, box(q, (0, 0, 0), (0.25, 0.16, 0.45), 0.04), 0.06)
        plinth = box(p, (0, 0, -0.1), (1.15, 1.0, 0.25), 0.05)
        return join(d, plinth, 0.06)

    return Body(f, halfspace((0, 0, 1), -0.15), (-1.5, -1.15, -0.45), (1.5, 1.15, 6.75), 300)


def _throne(p: Real) -> Real:
    """Return the field of the throne, with ribs on its sides."""
    seat = box(p, (0, 0.30, 0.68), (0.70, 0.72, 0.70), 0.05)
    back = box(p, (0, 0.92, 1.45), (0.66, 0.16, 0.85), 0.05)
    foot = box(p, (0, -0.45, 0.0), (0.74, 1.25, 0.14), 0.04)
    d = join(join(seat, back, 0.06), foot, 0.06)
    panel = 0.03 * np.cos(2 * np.pi * p[:, 2] / 0.22) * np.exp(-(((p[:, 2] - 0.75) / 0.5) ** 6))
    return d - panel * (np.abs(p[:, 0]) > 0.5)


def _crown(p: Real) -> Real:
    """Return the field of the crown: the disk of the sun between horns."""
    disk = ellipsoid(p, (0, 0.12, 4.42), (0.36, 0.09, 0.36))
    base = meet(np.hypot(p[:, 0], p[:, 1] - 0.12) - 0.26, np.abs(p[:, 2] - 3.98) - 0.10, 0.04)
    d = join(disk, base, 0.06)
    for s in (-1, 1):
        ends = [(0.14, 4.02), (0.42, 4.22), (0.50, 4.58), (0.40, 4.98)]
        horn = [(x * s, 0.12, z) for x, z in ends]
        d = join(d, tube(p, horn, [0.10, 0.095, 0.075, 0.035], 0.03), 0.05)
    return d


def isis_statue_body(seed: int = 0) -> Body:
    """A goddess on a throne with a child on her lap; horns and the sun's disk on her head."""
    head = Head(Person(jaw=0.95, nose=0.95, lips=1.1), NEUTRAL, ears=False, neck=False)
    small = Head(Person(jaw=1.0, nose=0.7, cheeks=1.3), NEUTRAL, ears=True, neck=False)
    stone = Noise(seed + 12, 0.5)

    def figure(p: Real) -> Real:
        d = ellipsoid(p, (0, 0.22, 2.15), (0.50, 0.36, 0.62))
        d = join(d, ellipsoid(p, (0, 0.18, 2.72), (0.62, 0.32, 0.28)), 0.2)
        d = join(d, ellipsoid(p, (0, 0.12, 1.62), (0.56, 0.48, 0.36)), 0.2)
        for s in (-1, 1):
            leg = [(0.24 * s, 0.1, 1.50), (0.24 * s, -0.95, 1.46), (0.22 * s, -0.98, 0.30)]
            d = join(d, tube(p, leg, [0.30, 0.25, 0.19], 0.08), 0.14)
            foot = [(0.22 * s, -0.95, 0.22), (0.23 * s, -1.42, 0.16)]
            d = join(d, tube(p, foot, [0.17, 0.13]), 0.08)
            d = join(d, sphere(p, (0.22 * s, -0.10, 2.46), 0.17), 0.08)
        # The dress between the shins: one solid down to the feet.
        d = join(d, tube(p, [(0, -0.92, 1.35), (0, -0.90, 0.25)], [0.22, 0.22]), 0.12)
        right = [(-0.62, 0.18, 2.72), (-0.66, 0.02, 2.02), (-0.18, -0.42, 2.12)]
        left = [(0.62, 0.18, 2.72), (0.68, 0.0, 2.02), (0.30, -0.60, 1.86)]
        d = join(d, ellipsoid(p, (0, -0.22, 1.92), (0.60, 0.44, 0.36)), 0.10)
        # The robe under the thighs and between arms and chest leaves no gap.
        d = join(d, box(p, (0, -0.48, 0.75), (0.40, 0.50, 0.72), 0.1), 0.10)
        for s in (-1, 1):
            d = join(d, ellipsoid(p, (0.46 * s, 0.08, 2.28), (0.22, 0.24, 0.50)), 0.10)
        for arm in (right, left):
            d = join(d, tube(p, arm, [0.19, 0.155, 0.12], 0.04), 0.10)
        return d

    def child(p: Real) -> Real:
        d = tube(p, [(-0.12, -0.62, 1.86), (0.10, -0.50, 2.0)], [0.24, 0.22])
        right = [(-0.20, -0.62, 1.82), (-0.36, -1.12, 1.74), (-0.34, -1.18, 1.40)]
        left = [(-0.02, -0.70, 1.82), (-0.08, -1.18, 1.74), (-0.08, -1.22, 1.40)]
        for leg in (right, left):
            d = join(d, tube(p, leg, [0.14, 0.11, 0.09]), 0.08)
        d = join(d, cone(p, (0.10, -0.52, 2.0), (0.18, -0.50, 2.30), 0.18, 0.11), 0.08)
        return join(d, _placed(small, p, (0.20, -0.52, 2.48), 0.22), 0.05)

    def f(p: Real) -> Real:
        d = join(figure(p), _throne(p), 0.08)
        d = join(d, child(p), 0.05)
        d = join(d, tube(p, [(0, 0.14, 2.8), (0, 0.10, 3.3)], [0.22, 0.19]), 0.15)
        d = join(d, _placed(head, p, (0, 0.04, 3.52), 0.40), 0.06)
        wig = ellipsoid(p, (0, 0.16, 3.62), (0.42, 0.42, 0.36))
        for s in (-1, 1):
            lock = [(0.34 * s, 0.12, 3.6), (0.36 * s, 0.06, 3.1), (0.32 * s, -0.10, 2.62)]
            wig = join(wig, tube(p, lock, [0.15, 0.16, 0.13]), 0.05)
        wig = join(wig, tube(p, [(0, 0.42, 3.6), (0, 0.42, 2.7)], [0.28, 0.3]), 0.08)
        strands = 0.013 * np.cos(2 * np.pi * p[:, 2] / 0.11)
        d = join(d, wig - strands, 0.03)
        d = join(d, _crown(p), 0.04)
        collar = np.linalg.norm(p - (0, 0.2, 3.05), axis=1)
        d = d - 0.02 * np.cos(2 * np.pi * collar / 0.12) * np.clip((0.62 - collar) * 6, 0, 1)
        return d - 0.004 * stone(p)

    return Body(f, halfspace((0, 0, 1), 0.0), (-1.1, -1.9, -0.3), (1.1, 1.35, 5.2), 260)
