"""Are two maps the same but for a Moebius map, which conformality cannot tell apart?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.geometry.moebius import Moebius

Complex = NDArray[np.complex128]


def closest_moebius(z: Complex, w: Complex) -> Moebius:
    """Which Moebius map carries the points z (n,) nearest to the points w (n,)?

    Least squares of ``a z + b - w (c z + 1)``, divided by the ``c z + 1`` of the step before, so
    that what is minimised in the end is the distance of the images.
    """
    weight = np.ones(len(z), dtype=np.complex128)
    a = b = c = 0j
    for _ in range(20):
        columns = np.stack([z, np.ones_like(z), -w * z], axis=1) / weight[:, None]
        (a, b, c), *_ = np.linalg.lstsq(columns, w / weight, rcond=None)
        following = c * z + 1
        if not np.abs(following).min() > 1e-12:
            break
        if np.abs(following - weight).max() <= 1e-14 * np.abs(weight).max():
            break
        weight = following
    return Moebius(complex(a), complex(b), complex(c), 1 + 0j)


def closest_similarity(z: Complex, w: Complex) -> Moebius:
    """Which turn, scale and shift carries z (n,) nearest to w (n,)?"""
    columns = np.stack([z, np.ones_like(z)], axis=1)
    (a, b), *_ = np.linalg.lstsq(columns, w, rcond=None)
    return Moebius(complex(a), complex(b), 0j, 1 + 0j)


def distance(z: Complex, w: Complex, *, moebius: bool) -> float:
    """How far are the maps apart when laid on each other?

    Root mean square, relative to the radius of w; infinite where they cannot be laid on.
    """
    onto = (closest_moebius if moebius else closest_similarity)(z, w)
    radius = float(np.sqrt((np.abs(w - w.mean()) ** 2).mean()))
    return float(np.sqrt((np.abs(onto(z) - w) ** 2).mean())) / radius
