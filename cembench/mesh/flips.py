"""What flipping many edges at once takes, for triangles known by their sides' lengths alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Indices = NDArray[np.int64]


class Independence:
    """Chooses edges that share no triangle, so that they can be flipped at once.

    Parameters
    ----------
    m : int
        How many triangles there are.

    """

    def __init__(self, m: int) -> None:
        self._first = np.empty(m, dtype=np.int64)

    def __call__(self, left: Indices, right: Indices) -> NDArray[np.bool_]:
        """Return which edges to take (k,), given the triangles on either side, best edges first.

        An edge is taken where no earlier one has either of its triangles.
        """
        order = np.arange(len(left))
        self._first[left] = self._first[right] = len(left)
        for triangles in (left, right):
            np.minimum.at(self._first, triangles, order)
        free: NDArray[np.bool_] = (self._first[left] == order) & (self._first[right] == order)
        return free


def distance_across(base: Real, left: Real, right: Real, left2: Real, right2: Real) -> Real:
    """Return how far the tips of two flat triangles are apart that share the edge `base`.

    `left` and `right` are one triangle's sides at the base's left and right end, `left2` and
    `right2` the other's at the same ends. All arrays have one shape.
    """
    foot, height = _foot_and_height(base, left, right)
    foot2, height2 = _foot_and_height(base, left2, right2)
    return np.asarray(np.hypot(foot - foot2, height + height2))


def area_of_sides(a: Real, b: Real, c: Real) -> Real:
    """Return triangles' areas from the lengths of their sides; 0 where they make no triangle.

    Kahan's order of the operations keeps the digits of thin triangles.
    """
    # In order of size, several times as fast as by a sort of three.
    low, high = np.minimum(a, b), np.maximum(a, b)
    z, x = np.minimum(low, c), np.maximum(high, c)
    y = np.maximum(low, np.minimum(high, c))
    product = (x + (y + z)) * (z - (x - y)) * (z + (x - y)) * (x + (y - z))
    area: Real = 0.25 * np.sqrt(np.maximum(product, 0))
    return area


def _foot_and_height(base: Real, left: Real, right: Real) -> tuple[Real, Real]:
    """Where a triangle's tip lies over its base: from the base's left end, and above it."""
    foot = (base * base + (left - right) * (left + right)) / (2 * base)
    return foot, 2 * area_of_sides(base, left, right) / base
