"""Distance of two maps up to a Moebius map or a similarity, which keep a map conformal."""

from __future__ import annotations

import numpy as np

from cembench.conformal.moebius import Moebius
from cembench.core.arrays import Complex

#: Steps of the reweighting below; a few are enough.
_STEPS = 20


def closest_moebius(z: Complex, w: Complex) -> Moebius:
    """Return the Moebius map that brings the points z (n,) closest to the points w (n,).

    Least squares of ``a z + b - w (c z + d)`` with coefficients of unit norm, divided by the
    ``c z + d`` of the previous step, so that the distance of the images is minimised in the limit.
    """
    columns = np.stack([z, np.ones_like(z), -w * z, -w], axis=1)
    weight = np.ones(len(z))
    parameters = np.zeros(4, dtype=np.complex128)
    for _ in range(_STEPS):
        before = parameters
        parameters = np.linalg.svd(columns / weight[:, None], full_matrices=False)[2][-1].conj()
        weight = np.abs(parameters[2] * z + parameters[3])
        if abs(np.vdot(before, parameters)) > 1 - 1e-14 or not weight.min() > 0:
            break
    return Moebius(*parameters.tolist())


def closest_similarity(z: Complex, w: Complex) -> Moebius:
    """Return the rotation, scale and shift that bring z (n,) closest to w (n,)."""
    columns = np.stack([z, np.ones_like(z)], axis=1)
    (a, b), *_ = np.linalg.lstsq(columns, w, rcond=None)
    return Moebius(complex(a), complex(b), 0j, 1 + 0j)


def distance(z: Complex, w: Complex, *, moebius: bool) -> float:
    """Return the distance of two maps after the best alignment.

    Root mean square, relative to the radius of w; infinite if they cannot be aligned.
    """
    radius = float(np.sqrt((np.abs(w - w.mean()) ** 2).mean()))
    if not radius:
        return float("inf")
    onto = (closest_moebius if moebius else closest_similarity)(z, w)
    return float(np.sqrt((np.abs(onto(z) - w) ** 2).mean())) / radius
