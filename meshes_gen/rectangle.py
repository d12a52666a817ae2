"""A triangulated rectangle, the domain of sheets, and its exact conformal map to the disk."""

from __future__ import annotations

import numpy as np
import scipy

from cembench.core.arrays import Complex, Indices


def rectangle_grid(faces: int, aspect: float) -> tuple[Complex, Indices]:
    """Return points and about `faces` triangles of the rectangle 0 <= x <= aspect, 0 <= y <= 1.

    Squares with alternating diagonals, an even number in each direction, so that every corner has a
    diagonal and therefore an interior neighbour (Definition 1). Counter-clockwise.
    """
    rows = max(2, 2 * round(np.sqrt(faces / (2 * aspect)) / 2))
    columns = max(2, 2 * round(faces / (2 * rows) / 2))
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    at = (i * (rows + 1) + j).ravel()
    right, up = rows + 1, 1
    a, b, c, d = at, at + right, at + right + up, at + up
    rising = ((i + j) % 2 == 0).ravel()
    F = np.concatenate(
        [
            np.stack([a, b, c], axis=1)[rising],
            np.stack([a, c, d], axis=1)[rising],
            np.stack([a, b, d], axis=1)[~rising],
            np.stack([b, c, d], axis=1)[~rising],
        ]
    )
    x, y = np.meshgrid(
        np.linspace(0, aspect, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij"
    )
    return (x + 1j * y).ravel(), F.astype(np.int64)


def rectangle_to_disk(z: Complex, aspect: float) -> Complex:
    """Return the conformal map of that rectangle to the unit disk, with its centre at the origin.

    Jacobi's sn maps the rectangle (-K, K) x (0, K') to the upper half-plane; aspect = 2 K / K'.
    Accurate for aspects between about 1/5 and 20.
    """

    def off(t: float) -> float:  # t is the logit of the complementary parameter
        m1 = 1 / (1 + np.exp(t))
        return float(
            2 * scipy.special.ellipkm1(m1) / scipy.special.ellipkm1(1 / (1 + np.exp(-t))) - aspect
        )

    t = scipy.optimize.brentq(off, -30, 30, xtol=1e-14, rtol=1e-14)
    m, m1 = 1 / (1 + np.exp(-t)), 1 / (1 + np.exp(t))
    K, K1 = scipy.special.ellipkm1(m1), scipy.special.ellipkm1(m)

    def sn(w: Complex) -> Complex:
        s, c, d, _ = scipy.special.ellipj(w.real, m)
        s1, c1, d1, _ = scipy.special.ellipj(w.imag, m1)
        return (s * d1 + 1j * c * d * s1 * c1) / (c1**2 + m * (s * s1) ** 2)

    w = (z / aspect - 0.5).real * 2 * K + 1j * z.imag * K1
    # The upper half is the reflection of the lower in the middle line, where sn has no pole.
    middle = sn(np.array([0.5j * K1]))[0]
    lower = z.imag <= 0.5
    out = np.empty(len(z), dtype=np.complex128)
    half = sn(np.where(lower, w, w.real + 1j * (K1 - w.imag)))
    image = (half - middle) / (half - np.conj(middle))
    # Reflection in the middle line conjugates the image, up to a rotation.
    edge = sn(np.array([0.5j * K1 + 0.3 * K]))[0]
    direction = (edge - middle) / (edge - np.conj(middle))
    direction /= abs(direction)
    out[lower] = image[lower]
    out[~lower] = np.conj(image[~lower] / direction) * direction
    return out / direction
