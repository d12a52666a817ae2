"""Small facts about polygons and triangles in the complex plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]


def polygon_area(z: Complex) -> float:
    """What area does a closed polygon enclose (Eq. 8)? Positive when counter-clockwise."""
    w = z - z[0]  # far from the origin the products would cancel
    return 0.5 * float(np.imag(np.conj(w) * np.roll(w, -1)).sum())


def signed_areas(uv: Complex, F: NDArray[np.int64]) -> NDArray[np.float64]:
    """What area has each triangle's image? Shape (m,); positive when counter-clockwise."""
    a, b, c = (uv[F[:, k]] for k in range(3))
    return 0.5 * np.imag(np.conj(b - a) * (c - a))


def backward_arcs(f_b: Complex) -> int:
    """How many arcs between consecutive points of a loop do not run counter-clockwise about 0?"""
    return int(np.count_nonzero(~(np.imag(np.conj(f_b) * np.roll(f_b, -1)) > 0)))


def fitted_circle(z: Complex) -> tuple[complex, float]:
    """Which circle lies closest to these points? Centre and radius, algebraic least squares (Kasa).

    Radius NaN where the points do not determine a circle.
    """
    middle = z.mean()
    w = z - middle
    scale = float(np.abs(w).max())
    if scale == 0:
        return complex(middle), float("nan")
    w = w / scale
    system = np.stack([w.real, w.imag, np.ones(len(w))], axis=1)
    (a, b, c), _, rank, _ = np.linalg.lstsq(system, np.abs(w) ** 2, rcond=None)
    if rank < 3:
        return complex(middle), float("nan")
    centre = complex(a, b) / 2
    return complex(middle + scale * centre), scale * float(np.sqrt(c + abs(centre) ** 2))
