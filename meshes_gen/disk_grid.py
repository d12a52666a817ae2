"""A nearly uniform triangulation of the unit disk, the domain of the closed-form surfaces."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Complex, Indices


def disk_grid(faces: int) -> tuple[Complex, Indices]:
    """Return points z (n,) and triangles F (m, 3) of r concentric rings, ring k with 6 k points.

    The number of triangles, 6 r^2, is as close as possible to `faces`. The triangulation is
    counter-clockwise, Delaunay up to rounding, and well-conditioned in the sense of Definition 1.
    """
    rings = max(2, round(np.sqrt(faces / 6)))
    k = np.repeat(np.arange(1, rings + 1), 6 * np.arange(1, rings + 1))
    first = np.concatenate([[0], 1 + 3 * np.arange(rings) * np.arange(1, rings + 1)])
    j = np.arange(len(k)) + 1 - first[k]
    z = np.concatenate([[0], k / rings * np.exp(2j * np.pi * j / (6 * k))])

    def at(ring: Indices, place: Indices) -> Indices:
        return np.where(ring == 0, 0, first[ring] + place % np.maximum(6 * ring, 1))

    # Each of the six sectors of ring k has k triangles with an edge on it, and k - 1 without.
    sector, step = j // k, j % k
    outward = np.stack([at(k, j), at(k, j + 1), at(k - 1, sector * (k - 1) + step)], axis=1)
    inward = np.stack(
        [at(k, j), at(k - 1, sector * (k - 1) + step), at(k - 1, sector * (k - 1) + step - 1)],
        axis=1,
    )[step > 0]
    return z, np.concatenate([outward, inward]).astype(np.int64)
