"""From an equilateral triangle to the unit disk: Dixon's elliptic function sm."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Complex

#: sm maps the triangle with corners at K times the cube roots of 1 to the unit disk, K to 1.
K = 1.7666387502854499
#: Number of times that an argument is halved, after which the series is exact.
HALVINGS = 6


def disk_of_triangle(z: Complex) -> Complex:
    """Return sm z, the inverse of the integral of (1 - w^3)^(-2/3) from 0 to w.

    Continued by reflection it has the periods 3 K and 3 K exp(2 pi i / 3), and takes neighbouring
    triangles to the outside of the disk.
    """
    omega = np.exp(2j * np.pi / 3)
    # Coordinates in the lattice of periods, rounded off.
    b = z.imag / (3 * K * omega.imag)
    a = z.real / (3 * K) - b * omega.real
    z = z - 3 * K * (np.round(a) + np.round(b) * omega)
    t = z / 2**HALVINGS
    t3 = t**3
    s = t * (1 - t3 / 6 + 2 * t3**2 / 63 - 13 * t3**3 / 2268)
    c = 1 - t3 / 3 + t3**2 / 18 - 23 * t3**3 / 2268
    with np.errstate(all="ignore"):
        for _ in range(HALVINGS):
            s3, c3 = s**3, c**3
            below = c * (1 + s3)
            s, c = s * (1 + c3) / below, (c3 - s3) / below
    return np.asarray(s)
