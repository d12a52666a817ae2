"""One step of a trust-region Newton method: conjugate gradients that stop at the region's edge.

Steihaug (1983), Toint (1981); Conn, Gould and Toint, Trust-Region Methods (2000), algorithm 7.5.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cembench.core.arrays import Real

Linear = Callable[[Real], Real]


@dataclass(frozen=True)
class Step:
    """A step p, its predicted decrease, its length and the number of products.

    `decrease` is -(g p + p H p / 2) > 0; `length` is the norm of p in the preconditioner M;
    `at_edge` is whether the trust region's radius cut it short.
    """

    p: Real
    decrease: float
    length: float
    at_edge: bool
    products: int


def newton_step(
    g: Real,
    uphill: Real,
    hessian: Linear,
    precondition: Linear,
    radius: float,
    accuracy: float,
    most: int = 200,
) -> Step:
    """Return a step p of norm at most `radius` that makes g p + p H p / 2 small.

    Parameters
    ----------
    g : float (N,)
        Gradient; not zero.
    uphill : float (N,)
        M^-1 g.
    hessian, precondition : callable
        Map (N,) to H p, symmetric, and to M^-1 r, symmetric positive definite (on a subspace, in
        which p then lies).
    radius : float
        Radius of the trust region in the norm of M.
    accuracy : float
        CG ends if the residual's norm in M^-1 is this share of the gradient's.
    most : int
        Maximal number of products with H.
    """
    p, Hp = np.zeros_like(g), np.zeros_like(g)
    residual, y = g, uphill
    d = -y
    first = size = float(residual @ y)
    # |p|^2, <p, d> and |d|^2 in the norm of M follow by recurrence, so M itself is not needed.
    pp, pd, dd = 0.0, 0.0, size
    for products in range(1, most + 1):
        Hd = hessian(d)
        curvature = float(d @ Hd)
        t = size / curvature if curvature > 0 else np.inf
        if not pp + 2 * t * pd + t * t * dd < radius**2:
            t = (np.sqrt(pd**2 + dd * (radius**2 - pp)) - pd) / dd
            p, Hp = p + t * d, Hp + t * Hd
            return Step(p, -float(g @ p + p @ Hp / 2), radius, True, products)
        p, Hp = p + t * d, Hp + t * Hd
        pp += 2 * t * pd + t * t * dd
        residual = residual + t * Hd
        y = precondition(residual)
        following = float(residual @ y)
        if not following > accuracy**2 * first:
            break
        pd = following / size * (pd + t * dd)
        dd = following + (following / size) ** 2 * dd
        d = -y + following / size * d
        size = following
    return Step(p, -float(g @ p + p @ Hp / 2), float(np.sqrt(pp)), False, products)
