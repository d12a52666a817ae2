"""Simultaneous edge flips of triangles that are known by their side lengths alone."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices, Mask, Real


class Independence:
    """Select edges that share no triangle, so that all can be flipped at once.

    Parameters
    ----------
    m : int
        Number of triangles.
    """

    def __init__(self, m: int) -> None:
        self._first = np.empty(m, dtype=np.int64)

    def __call__(self, left: Indices, right: Indices) -> Mask:
        """Return the selected edges (k,), given the triangles on either side, best edges first.

        An edge is selected if no earlier edge has either of its triangles.
        """
        order = np.arange(len(left))
        self._first[left] = self._first[right] = len(left)
        for triangles in (left, right):
            np.minimum.at(self._first, triangles, order)
        return (self._first[left] == order) & (self._first[right] == order)


def distance_across(base: Real, left: Real, right: Real, left2: Real, right2: Real) -> Real:
    """Return the distance between the tips of two flat triangles that share the edge `base`.

    `left` and `right` are one triangle's sides at the left and right end of the base, `left2` and
    `right2` the other's at the same ends. All arrays have one shape.
    """
    foot, height = _foot_and_height(base, left, right)
    foot2, height2 = _foot_and_height(base, left2, right2)
    return np.asarray(np.hypot(foot - foot2, height + height2))


def area_of_sides(a: Real, b: Real, c: Real) -> Real:
    """Return the areas of triangles from their side lengths; 0 if they form no triangle.

    Kahan's order of operations preserves the digits of thin triangles.
    """
    # In order of size, several times as fast as by a sort of three.
    low, high = np.minimum(a, b), np.maximum(a, b)
    z, x = np.minimum(low, c), np.maximum(high, c)
    y = np.maximum(low, np.minimum(high, c))
    product = (x + (y + z)) * (z - (x - y)) * (z + (x - y)) * (x + (y - z))
    return 0.25 * np.sqrt(np.maximum(product, 0))


def _foot_and_height(base: Real, left: Real, right: Real) -> tuple[Real, Real]:
    """Return the position of a triangle's tip along and above its base, from the left end."""
    foot = (base * base + (left - right) * (left + right)) / (2 * base)
    return foot, 2 * area_of_sides(base, left, right) / base
