"""Moebius maps z -> (a z + b) / (c z + d), the conformal maps of the sphere to itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cembench.core.arrays import Complex
from cembench.core.errors import AlgorithmFailed


@dataclass(frozen=True)
class Moebius:
    """The map z -> (a z + b) / (c z + d) with a d - b c not zero."""

    a: complex
    b: complex
    c: complex
    d: complex

    def __call__(self, z: Complex) -> Complex:
        """Return the images of finite points z (n,); -d / c goes to infinity."""
        top, bottom = self.a * z + self.b, self.c * z + self.d
        image = np.full(z.shape, complex(np.inf))
        np.divide(top, bottom, out=image, where=bottom != 0)
        return image

    @property
    def inverse(self) -> Moebius:
        """Return the inverse map."""
        return Moebius(self.d, -self.b, -self.c, self.a)


def three_point_map(p: Sequence[complex] | Complex, q: Sequence[complex] | Complex) -> Moebius:
    """Return the Moebius map that takes three finite points p to three finite points q.

    Raises
    ------
    AlgorithmFailed
        Two of the points coincide, or are not finite.
    """
    points = np.array([p, q], dtype=np.complex128)
    apart = np.abs(points - np.roll(points, 1, axis=1)).min()
    if not apart > 0 or not np.isfinite(points).all():
        raise AlgorithmFailed(
            f"no Moebius map carries the points {points[0].tolist()} to {points[1].tolist()}: "
            "three distinct finite points are needed on either side"
        )
    forth, back = (_to_zero_one_infinity(*three) for three in points)
    a, b, c, d = np.linalg.solve(back, forth).ravel().tolist()
    return Moebius(a, b, c, d)


def _to_zero_one_infinity(p: complex, q: complex, r: complex) -> Complex:
    """Return the matrix of the Moebius map that takes p, q, r to 0, 1, infinity."""
    return np.array([[q - r, -p * (q - r)], [q - p, -r * (q - p)]])
