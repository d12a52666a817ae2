"""Busts and heads: a crowned queen, a curly head, a draped girl, a man with a knit cap."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real

from .head import NEUTRAL, Expression, Head, Person
from .implicit import (
    Body,
    Noise,
    bump,
    carve,
    cone,
    ellipsoid,
    halfspace,
    join,
    meet,
    ring,
    sphere,
    tube,
)


def nefertiti_body(seed: int = 0) -> Body:
    """A slender neck under a face with a tall flat-topped crown; coarse enough for 562 faces."""
    person = Person(jaw=0.86, nose=1.0, nose_width=0.9, lips=1.2, eyes=1.0, cheeks=0.9)
    head = Head(person, NEUTRAL, ears=False, neck=False)
    lean = 0.01 * np.sin(seed)

    def f(p: Real) -> Real:
        d = head(p)
        neck = [(0, 0.16, -0.5), (lean, 0.34, -1.35), (0, 0.62, -2.2)]
        d = join(d, tube(p, neck, [0.40, 0.33, 0.42]), 0.15)
        base = ellipsoid(p, (0, 0.70, -2.5), (1.15, 0.52, 0.55))
        d = join(d, base, 0.25)
        axis = np.array([0, 0.62, 0.78]) / np.hypot(0.62, 0.78)
        crown = cone(p, (0, 0.16, 0.30), (0, 1.50, 2.0), 0.70, 1.22)
        crown = meet(crown, p @ axis - 1.78, 0.06)
        crown = meet(crown, -(p @ np.array([0, 0.15, 0.99])) + 0.30, 0.06)
        d = join(d, crown, 0.05)
        for s in (-1, 1):
            d = join(d, ellipsoid(p, (0.70 * s, 0.12, -0.10), (0.07, 0.15, 0.24)), 0.08)
        return d

    return Body(f, halfspace((0, 0, 1), -2.5), (-1.4, -1.35, -2.75), (1.4, 2.4, 2.2), 130)


def david_head_body(seed: int = 0) -> Body:
    """A young man's head with thick curls, cut through the neck."""
    person = Person(jaw=1.02, nose=1.1, nose_width=1.0, lips=1.1, eyes=1.15, brow=1.4)
    head = Head(person, Expression(brows=(-0.04, -0.04)))
    rng = np.random.default_rng(seed + 3)
    # Locks: short bent tubes, spread evenly (golden angle) over the hairy part of the skull.
    k = np.arange(150)
    z = 1 - 2 * (k + 0.5) / 150
    angle = k * np.pi * (3 - np.sqrt(5))
    way = np.stack(
        [np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1
    )
    way = way[(0.55 * way[:, 1] + way[:, 2] > -0.20) | ((way[:, 1] > 0.45) & (way[:, 2] > -0.8))]
    centre, radii = np.array([0, 0.24, 0.34]), np.array([0.82, 0.92, 0.82])
    roots = centre + way * radii
    turns = rng.uniform(0, 2 * np.pi, len(way))

    def f(p: Real) -> Real:
        d = join(head(p), ellipsoid(p, centre, radii + 0.015), 0.06)
        for root, w, turn in zip(roots, way, turns, strict=True):
            near = np.abs(p - root).max(axis=1) < 0.42
            if not near.any():
                continue
            u = np.cross(w, [np.cos(turn), np.sin(turn), 0.3])
            u /= np.linalg.norm(u)
            v = np.cross(w, u)
            bend = [root + 0.11 * (np.cos(t) * u + np.sin(t) * v) for t in (0, 1.5, 3, 4.5)]
            d[near] = join(d[near], tube(p[near], bend, [0.085, 0.08, 0.07, 0.04]), 0.03)
        return d

    return Body(f, halfspace((0, -0.35, 0.94), -1.42), (-1.2, -1.35, -2.1), (1.2, 1.55, 1.5), 180)


def bimba_statue_body(seed: int = 0) -> Body:
    """A girl's bust: hair drawn back to a plaited knot, a cloak in folds over the shoulders."""
    person = Person(jaw=0.95, nose=0.8, nose_width=0.95, lips=1.0, eyes=1.05, brow=0.8, cheeks=1.2)
    head = Head(person, NEUTRAL)
    folds = Noise(seed + 9, 0.5)
    hair = Noise(seed + 15, 0.5)

    def f(p: Real) -> Real:
        d = head(p)
        wig = ellipsoid(p, (0, 0.26, 0.36), (0.83, 0.93, 0.80))
        strand = np.cos(26 * np.arctan2(p[:, 0], p[:, 2] + 0.3) + 2.0 * hair(p))
        wig = wig - 0.020 * strand * np.clip((p[:, 1] + 0.65) * 4, 0, 1) * np.clip(
            (1.0 - p[:, 1]) * 3, 0, 1
        )
        d = join(d, wig, 0.03)
        knot = ellipsoid(p, (0, 1.22, 0.42), (0.36, 0.30, 0.36))
        twist = np.arctan2(p[:, 2] - 0.42, p[:, 0])
        depth = np.linalg.norm(p - (0, 1.22, 0.42), axis=1)
        d = join(d, knot - 0.03 * np.cos(5 * twist + 14 * depth), 0.06)
        plait = ring(p, (0, 0.28, 0.52), (0, -0.45, 0.9), 0.86, 0.085)
        around = np.arctan2(p[:, 0], p[:, 1] - 0.28)
        d = join(d, plait - 0.022 * np.abs(np.sin(17 * around)), 0.03)
        chest = ellipsoid(p, (0, 0.36, -2.55), (1.42, 0.72, 0.85))
        chest = join(chest, cone(p, (-1.05, 0.42, -2.25), (1.05, 0.42, -2.25), 0.40, 0.40), 0.3)
        chest = join(chest, ellipsoid(p, (0, 0.0, -2.75), (0.85, 0.58, 0.55)), 0.2)
        # The cloak falls from the shoulders in folds that meet in front.
        fall = np.hypot(p[:, 0] * 0.75, p[:, 2] + 1.25)
        wave = np.cos(13 * fall + 1.2 * folds(p) + 2.2 * p[:, 0])
        cloak = chest - 0.075 - 0.055 * wave
        neckline = np.linalg.norm((p - (0, -0.05, -1.62)) / (0.62, 1.0, 0.72), axis=1) - 1
        d = join(d, chest, 0.18)
        return join(d, carve(cloak, neckline * 0.6, 0.06), 0.04)

    return Body(f, halfspace((0, 0, 1), -3.0), (-1.85, -1.35, -3.25), (1.85, 1.75, 1.4), 170)


def knit_cap_man_body(seed: int = 0) -> Body:
    """A bearded man with a knit cap: turned-up rim, pompon, and a bump for every stitch."""
    person = Person(
        jaw=1.08, nose=1.15, nose_width=1.2, lips=0.95, eyes=0.95, brow=1.3, cheeks=1.05
    )
    head = Head(person, NEUTRAL)
    beard = Noise(seed + 2, 0.13, waves=30)
    fluff = Noise(seed + 8, 0.10, waves=30)
    middle = np.array([0, 0.17, 0.42])
    tuft = np.array([0, 0.22, 1.38])
    ribs = 44

    def stitches(p: Real, amplitude: float) -> Real:
        q = p - middle
        around = np.arctan2(q[:, 0], q[:, 1]) * ribs / (2 * np.pi)
        up = q[:, 2] / 0.115
        across = np.abs(2 * (around - np.floor(around)) - 1)  # 1 in the valley between two ribs
        leg = np.cos(2 * np.pi * (up + 0.55 * across))  # the two legs of a stitch make a V
        rib = np.sqrt(np.maximum(1e-9, 1 - (2 * np.abs(across - 0.5)) ** 2))
        top = np.clip((1.02 - q[:, 2]) * 3, 0, 1) * np.clip(np.hypot(q[:, 0], q[:, 1]) * 3, 0, 1)
        return amplitude * (0.7 * rib + 0.5 * leg * rib - 0.5) * top

    def knitted(p: Real) -> Real:
        cap = ellipsoid(p, middle + (0, 0.02, 0.02), (0.88, 1.04, 0.84))
        cap = meet(cap, 0.22 - p[:, 2] + 0.12 * p[:, 1], 0.05)
        rim = ellipsoid(p, middle, (0.955, 1.115, 1.12))
        level = p[:, 2] - 0.12 * p[:, 1]
        rim = meet(rim, np.abs(level - 0.33) - 0.17, 0.14)
        cap = join(cap - stitches(p, 0.034), rim - stitches(p, 0.040), 0.06)
        outwards = p - tuft
        outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-9) / 0.26
        pompon = sphere(p, tuft, 0.26) - 0.022 * fluff(outwards)
        return join(cap, pompon, 0.03)

    def f(p: Real) -> Real:
        d = head(p)
        chin = bump(p, (0, -0.45, -0.95), (0.62, 0.42, 0.36))
        mouth = bump(p, (0, -0.85, -0.62), (0.24, 0.3, 0.10))
        d = d - np.clip(chin - mouth, 0, 1) * (0.09 + 0.018 * beard(p))
        upper = p[:, 2] > -0.35
        if upper.any():
            d[upper] = join(d[upper], knitted(p[upper]), 0.02)
        collar = ring(p, (0, 0.33, -1.62), (0, 0.1, 1), 0.46, 0.13)
        return join(d, collar, 0.05)

    return Body(f, halfspace((0, 0, 1), -1.80), (-1.25, -1.4, -2.0), (1.25, 1.55, 1.8), 220)
