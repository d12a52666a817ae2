"""Moebius centring: conformal maps of the sphere that move the centre of mass to the origin.

Baden, Crane & Kazhdan 2018, Moebius registration, Algorithm 1.
"""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real
from cembench.core.errors import AlgorithmFailed

#: Newton steps are cut to this length; a step of length 1 would map the sphere to a point.
LONGEST_STEP = 0.5


def moebius_centred(
    S: Real, mass: Real, *, tolerance: float = 1e-12, max_iterations: int = 100
) -> Real:
    """Move points S (n, 3) of the unit sphere so that their centre of `mass` (n,) is the origin.

    Newton's method with inversions; it converges if no point holds half of the mass.

    Raises
    ------
    AlgorithmFailed
        The centre is not within `tolerance` of the origin after `max_iterations`.
    """
    share = mass / mass.sum()
    for _ in range(max_iterations):
        centre = share @ S
        if np.linalg.norm(centre) <= tolerance:
            return S
        jacobian = 2 * (np.eye(3) - (share[:, None] * S).T @ S)
        try:
            step = -np.linalg.solve(jacobian, centre)
        except np.linalg.LinAlgError:
            break  # all points coincide
        length = float(np.linalg.norm(step))
        S = _inverted(S, step * min(1.0, LONGEST_STEP / length) if length > 0 else step)
    raise AlgorithmFailed(
        f"the map to the sphere cannot be centred: its centre of mass is still "
        f"{np.linalg.norm(share @ S):.3g} away from the origin after {max_iterations} steps; the "
        "image has collapsed to a point or to two"
    )


def _inverted(S: Real, c: Real) -> Real:
    """Return the conformal map of the sphere that moves points along c, |c| < 1."""
    moved = S + c
    squared = np.einsum("nd,nd->n", moved, moved)
    S = (1 - c @ c) / squared[:, None] * moved + c
    return S / np.linalg.norm(S, axis=1, keepdims=True)
