"""A parametric human head: one person, many expressions.

Units are about 9 cm. The face looks along -y, z is up, and x = 0 is the plane of symmetry. The head
is 1.5 wide, from the chin at z = -1.15 to the crown at z = 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cembench.core.arrays import Real

from .implicit import Field, Noise, carve, cone, ellipsoid, join, rotation, sphere, tube


@dataclass(frozen=True)
class Person:
    """A person's proportions, relative to an average of 1; the same for all expressions."""

    jaw: float = 1.0
    nose: float = 1.0
    nose_width: float = 1.0
    lips: float = 1.0
    eyes: float = 1.0
    brow: float = 1.0
    cheeks: float = 1.0
    skin_seed: int = 0


@dataclass(frozen=True)
class Expression:
    """The action of the facial muscles; zero is neutral. Lengths are in the head's units.

    `corners` raises the mouth's (right, left) corner, `width` moves both outwards, `pout` pushes
    the lips forward, `shift` moves the mouth sideways, `cheeks` raises the cheeks, `brows` the
    (right, left) brow, `squint` narrows the eyes.
    """

    corners: tuple[float, float] = (0.0, 0.0)
    width: float = 0.0
    pout: float = 0.0
    shift: float = 0.0
    cheeks: float = 0.0
    brows: tuple[float, float] = (0.0, 0.0)
    squint: float = 0.0


NEUTRAL = Expression()
SMILE = Expression(corners=(0.09, 0.09), width=0.075, cheeks=0.05, squint=0.3)
POUTING = Expression(corners=(-0.035, -0.035), width=-0.10, pout=0.10, brows=(-0.03, -0.03))
WRY = Expression(
    corners=(0.13, -0.05), width=0.02, shift=0.07, cheeks=0.02, brows=(0.06, -0.03), squint=0.1
)


#: Share of its outermost part that the groove between pouting lips keeps.
SHORTENED = 0.5


@dataclass(frozen=True)
class Head:
    """The implicit field of a head, and its landmarks."""

    person: Person = Person()
    expression: Expression = NEUTRAL
    ears: bool = True
    neck: bool = True

    def skull(self, p: Real) -> Real:
        """Return the field of the head without features."""
        j = self.person.jaw
        d = ellipsoid(p, (0, 0.15, 0.30), (0.76, 0.94, 0.80))
        d = join(d, ellipsoid(p, (0, -0.20, -0.33), (0.57 * j, 0.58, 0.78)), 0.25)
        d = join(d, ellipsoid(p, (0, -0.60, -0.97), (0.20 * j, 0.15, 0.14)), 0.3)
        return join(d, ellipsoid(p, (0, -0.02, -0.72), (0.54 * j, 0.40, 0.28)), 0.25)

    def front(self, x: float, z: float) -> float:
        """Return the y at which a ray from the front meets the skull at (x, z)."""
        y = np.linspace(-1.6, 0.2, 3601)
        d = self.skull(np.stack([np.full_like(y, x), y, np.full_like(y, z)], axis=1))
        return float(y[np.argmax(d < 0)])

    def _mouth(self) -> Real:
        """Return five points along the line where the lips meet, right corner to left; (5, 3)."""
        e = self.expression
        half = 0.245 * self.person.lips + e.width
        x = e.shift + half * np.array([-1, -0.55, 0, 0.55, 1])
        rise = np.array([e.corners[0], 0.25 * e.corners[0], 0, 0.25 * e.corners[1], e.corners[1]])
        z = -0.615 + rise
        push = e.pout * np.array([0.25, 0.9, 1.15, 0.9, 0.25]) + [0, 0.03, 0.045, 0.03, 0]
        y = np.array([self.front(a, b) for a, b in zip(x, z, strict=True)]) - push
        return np.stack([x, y, z], axis=1)

    @cached_property
    def _points(self) -> dict[str, Real]:
        # Assigned at once, since fields are evaluated on several threads.
        P, c = self.person, dict[str, Real]()
        c["mouth"] = self._mouth()
        for s, side in ((-1, "right"), (1, "left")):
            x = 0.275 * s
            c[f"eye_{side}"] = np.array([x, self.front(x, -0.02) + 0.075, -0.02])
            x, z = 0.36 * s, -0.30
            c[f"cheek_{side}"] = np.array([x, self.front(x, z) + 0.13, z + self.expression.cheeks])
            bx = np.array([0.12, 0.30, 0.47]) * s
            bz = np.array([0.13, 0.185, 0.13]) + self.expression.brows[(s + 1) // 2]
            by = np.array([self.front(a, b) for a, b in zip(bx, bz, strict=True)]) + 0.0
            c[f"brow_{side}"] = np.stack([bx, by, bz], axis=1)
        c["tip"] = np.array([0, self.front(0, -0.33) - 0.21 * P.nose, -0.335])
        c["bridge"] = np.array([0, self.front(0, 0.06) - 0.0, 0.08])
        c["base"] = np.array([0, self.front(0, -0.34) - 0.02, -0.34])
        return c

    def __call__(self, p: Real) -> Real:
        """Return the field at points p (n, 3)."""
        d = self.skull(p)
        # Features are local: adding them changes nothing farther away.
        front = (p[:, 1] < -0.2) & (p[:, 2] < 0.55) & (p[:, 2] > -1.35)
        if front.any():
            d[front] = self._features(p[front], d[front])
        if self.ears:
            for s in (-1, 1):
                near = np.abs(p - (0.80 * s, 0.12, -0.08)).max(axis=1) < 0.5
                if near.any():
                    d[near] = join(d[near], self._ear(p[near], s), 0.06)
        if self.neck:
            throat = [(0, 0.22, -0.55), (0, 0.30, -1.3), (0, 0.36, -2.2)]
            d = join(d, tube(p, throat, [0.43, 0.42, 0.5]), 0.15)
        return d

    def _features(self, p: Real, d: Real) -> Real:
        """Add cheeks, brows, eyes, nose and mouth to the skull's field d at p."""
        P, e, c = self.person, self.expression, self._points
        for side in ("right", "left"):
            eye = c[f"eye_{side}"]
            d = join(d, sphere(p, c[f"cheek_{side}"], (0.15 + 0.35 * e.cheeks) * P.cheeks), 0.16)
            d = carve(d, ellipsoid(p, eye + (0, -0.09, 0), (0.185, 0.12, 0.115)), 0.12)
            d = join(d, tube(p, c[f"brow_{side}"], [0.045, 0.055 * P.brow, 0.035]), 0.09)
        upper = c["bridge"] + (0, 0.05, 0)
        d = join(d, cone(p, upper, c["base"], 0.06, 0.125 * P.nose_width), 0.10)
        d = join(d, cone(p, c["bridge"], c["tip"], 0.045, 0.085 * P.nose_width), 0.10)
        for s in (-1, 1):
            wing = c["tip"] + (0.095 * s * P.nose_width, 0.10, -0.035)
            d = join(d, sphere(p, wing, 0.062), 0.05)
            hole = c["tip"] + (0.052 * s * P.nose_width, 0.055, -0.10)
            d = carve(d, cone(p, hole, hole + (0.01 * s, 0.05, 0.09), 0.030, 0.02), 0.02)
        for side in ("right", "left"):
            d = self._eye(p, d, c[f"eye_{side}"])
        return self._lips(p, d, c["mouth"])

    def _eye(self, p: Real, d: Real, centre: Real) -> Real:
        open_ = self.person.eyes * (1 - self.expression.squint)
        ball = sphere(p, centre + (0, 0.045, 0), 0.135)
        lid = ellipsoid(p, centre + (0, 0.045, 0), (0.165, 0.158, 0.15))
        slit = ellipsoid(p, centre + (0, -0.12, -0.005), (0.118, 0.14, 0.052 * open_))
        return join(d, join(carve(lid, slit, 0.015), ball, 0.006), 0.035)

    def _lips(self, p: Real, d: Real, line: Real) -> Real:
        thick = (0.056 + 0.12 * self.expression.pout) * self.person.lips
        radii = thick * np.array([0.35, 0.85, 0.95, 0.85, 0.35])
        inwards = np.array([0, 0.02, 0])
        upper = line + inwards + np.outer([0.0, 0.9, 0.75, 0.9, 0.0], [0, 0, thick])
        lower = line + inwards - np.outer([0.0, 0.8, 1.1, 0.8, 0.0], [0, 0, thick])
        if self.expression.pout > 0:  # the tissue behind lips that are pushed forward
            d = join(d, tube(p, line + (0, 0.10, 0), 1.3 * thick, 0.03), 0.12)
        d = join(d, tube(p, upper, radii, 0.03), 0.04)
        d = join(d, tube(p, lower, 1.1 * radii, 0.03), 0.04)
        depth = 0.017 + 0.12 * self.expression.pout
        between = self._between_lips() - inwards * 0.6
        groove = tube(p, between, np.array([0.6, 1, 1, 1, 0.6]) * depth, 0.01)
        return carve(d, groove, 0.025)

    def _between_lips(self) -> Real:
        """Return five points along the groove between the lips, right corner to left; (5, 3).

        If the lips are pushed forward, their ends close over the mouth's line. The groove ends
        before that; otherwise it would continue below them as a tunnel.
        """
        line = self._points["mouth"].copy()
        if self.expression.pout > 0:
            line[[0, 4]] = line[[1, 3]] + SHORTENED * (line[[0, 4]] - line[[1, 3]])
        return line

    def _ear(self, p: Real, s: int) -> Real:
        turn = rotation("z", -s * 25.0) @ rotation("x", -10.0)
        at = np.array([0.80 * s, 0.12, -0.08])
        d = ellipsoid(p, at, (0.065, 0.17, 0.27), turn)
        hollow = ellipsoid(p, at + (0.065 * s, -0.02, 0.03), (0.06, 0.10, 0.17), turn)
        return carve(d, hollow, 0.04)

    def landmarks(self) -> dict[str, Real]:
        """Return points near the surface: nose tip, corners of eyes and mouth, lips; (3,) each."""
        c, P, mouth = self._points, self.person, self._between_lips()
        vertices = {
            "nose_tip": c["tip"] + (0, -0.085 * P.nose_width, 0),
            "mouth_corner_right": mouth[0],
            "mouth_corner_left": mouth[4],
            "lips_right": mouth[1],
            "lips_middle": mouth[2],
            "lips_left": mouth[3],
        }
        for s, side in ((-1, "right"), (1, "left")):
            eye = c[f"eye_{side}"]
            vertices[f"eye_inner_{side}"] = eye + (-0.115 * s, -0.09, -0.005)
            vertices[f"eye_outer_{side}"] = eye + (0.115 * s, -0.09, -0.005)
        return vertices


def with_skin(head: Field, seed: int, amplitude: float = 0.0025) -> Field:
    """Return the same head with seeded unevenness of the skin."""
    broad, fine = Noise(seed, 0.30), Noise(seed + 1, 0.10)
    return lambda p: head(p) - amplitude * (broad(p) + 0.4 * fine(p))
