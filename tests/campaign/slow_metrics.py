"""Conformal energy and angles once more, slowly: fifty decimal digits, no shared code.

Each figure comes with a bound of what rounding may have done to it in double precision: slivers
make cotangents inaccurate, and that is no fault of whoever computes with doubles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext

EPS = 2.0**-52
DIGITS = 50


@dataclass(frozen=True)
class Reference:
    """A figure, and how far from it an honest computation in doubles may end."""

    value: float
    bound: float

    def agrees(self, other: float) -> bool:
        """Whether a figure is this one up to rounding."""
        return math.isfinite(other) and abs(other - self.value) <= self.bound


def conformal_energy(
    V: Sequence[Sequence[float]], faces: Sequence[Sequence[int]], uv: Sequence[complex]
) -> Reference:
    """E_C = E_D - A: of each triangle, E_D by cotangents (Eq. 5), A the signed area (Eq. 8)."""
    with localcontext() as context:
        context.prec = DIGITS
        energy, size = Decimal(0), 0.0
        image = [[Decimal(z.real), Decimal(z.imag)] for z in uv]
        space = [[Decimal(x) for x in point] for point in V]
        for face in faces:
            dots, double_area, poor = _corners([space[k] for k in face])
            a, b, c = (image[k] for k in face)
            lengths = [_squared(b, c), _squared(c, a), _squared(a, b)]
            for dot, length in zip(dots, lengths, strict=True):
                term = dot / double_area * length / 4
                energy += term
                size += abs(float(term)) * poor
            energy -= ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2
        return Reference(float(energy), 1000 * EPS * (size + len(faces)))


def mean_angle_error(
    V: Sequence[Sequence[float]], faces: Sequence[Sequence[int]], uv: Sequence[complex]
) -> Reference:
    """Return the mean change of a corner's angle, in degrees."""
    with localcontext() as context:
        context.prec = DIGITS
        changes, rounding = [], 0.0
        image = [[Decimal(z.real), Decimal(z.imag)] for z in uv]
        space = [[Decimal(x) for x in point] for point in V]
        for face in faces:
            before, poor = _angles([space[k] for k in face])
            after, worse = _angles([image[k] for k in face])
            changes += [abs(p - q) for p, q in zip(before, after, strict=True)]
            rounding += min(180.0, 1000 * EPS * (poor + worse + _far(uv, face)))
        bound = 1e-9 + 3 * rounding / len(changes)
        return Reference(math.fsum(changes) / len(changes), bound)


def _far(uv: Sequence[complex], face: Sequence[int]) -> float:
    """Return how small a triangle is beside its distance from 0: that cancels digits."""
    a, b, c = (uv[k] for k in face)
    least = min(abs(a - b), abs(b - c), abs(c - a))
    return max(abs(a), abs(b), abs(c)) / least if least else math.inf


def _corners(p: Sequence[Sequence[Decimal]]) -> tuple[list[Decimal], Decimal, float]:
    """Return the dot product at each corner, the double area, and how much a sliver it is."""
    squares = [_squared(p[1], p[2]), _squared(p[2], p[0]), _squared(p[0], p[1])]
    dots = [
        sum(
            ((q - o) * (r - o) for o, q, r in zip(p[k], p[k - 2], p[k - 1], strict=True)),
            Decimal(0),
        )
        for k in range(3)
    ]
    squared_area = dots[0] * dots[1] + dots[1] * dots[2] + dots[2] * dots[0]
    double_area = squared_area.sqrt() if squared_area > 0 else Decimal(0)
    poor = float(max(squares) / double_area) if double_area else math.inf
    return dots, double_area, poor


def _angles(p: Sequence[Sequence[Decimal]]) -> tuple[list[float], float]:
    dots, double_area, poor = _corners(p)
    scale = max(abs(d) for d in [*dots, double_area]) or Decimal(1)
    angles = [math.atan2(float(double_area / scale), float(dot / scale)) for dot in dots]
    return [math.degrees(angle) for angle in angles], poor


def _squared(p: Sequence[Decimal], q: Sequence[Decimal]) -> Decimal:
    return sum(((a - b) ** 2 for a, b in zip(p, q, strict=True)), Decimal(0))
