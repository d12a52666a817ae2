"""Stereographic projection between the unit sphere and the complex plane through its equator.

From the north pole (0, 0, 1) it keeps (X, Y) and reverses orientation as seen from outside the
sphere; from the south pole it keeps that orientation. The two images z, w of a point are mirror
images in the unit circle, w = 1 / conj(z).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from cembench.core.arrays import Complex, Real

Pole = Literal["north", "south"]


def to_plane(S: Real, pole: Pole = "north") -> Complex:
    """Project points S (n, 3) of the sphere from a pole; (n,), infinite at the pole."""
    distance = 1 - S[:, 2] if pole == "north" else 1 + S[:, 2]
    z = np.full(len(S), complex(np.inf))
    np.divide(S[:, 0] + 1j * S[:, 1], distance, out=z, where=distance != 0)
    return z


def to_sphere(z: Complex, pole: Pole = "north") -> Real:
    """Return the points (n, 3) of the sphere that project to z (n,); infinity gives the pole."""
    modulus = np.abs(z)
    far = modulus > 1
    # The larger of |z| and 1 / |z| is never squared, so nothing overflows.
    near = np.minimum(modulus, 1 / np.maximum(modulus, 1))
    radius = 2 * near / (1 + near**2)
    height = np.where(far, 1, -1) * (1 - near) * (1 + near) / (1 + near**2)
    angle = np.angle(np.where(np.isfinite(z), z, 0))
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), height if pole == "north" else -height],
        axis=1,
    )
