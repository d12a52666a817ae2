"""Side lengths of triangles."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices, Real


def side_lengths(V: Real, F: Indices) -> Real:
    """Return the length of the side opposite to each corner.

    Parameters
    ----------
    V : float (n, 2) or (n, 3)
        Vertices.
    F : int64 (m, 3)
        Triangles.

    Returns
    -------
    float (m, 3)
        In the unit of V. Side c runs from corner c + 1 to corner c + 2 (modulo 3).
    """
    return np.linalg.norm(V[F[:, [2, 0, 1]]] - V[F[:, [1, 2, 0]]], axis=2)


def loop_width(loop: Real) -> float:
    """Return the mean square distance of a closed polygon's points (k, 3) from their centroid."""
    after, middle = np.roll(loop, -1, axis=0), (loop + np.roll(loop, -1, axis=0)) / 2
    lengths = np.linalg.norm(after - loop, axis=1)
    away = middle - np.average(middle, axis=0, weights=lengths)
    return float(np.average((away**2).sum(axis=1), weights=lengths))
