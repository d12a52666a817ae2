"""The flat metric that is discretely conformally equivalent to a surface, by Newton's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.discrete_metric import (
    BlockPattern,
    angle_sums,
    angles,
    half_cotangents_of,
    scaled,
)
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.cholesky import Cholesky, factor_like

#: A step is taken if the energy's upward slope at its end is at most this share of the slope at its
#: start: the energy is convex, so its minimum along the step is then near the end or beyond.
UPHILL = 0.5
#: Maximal number of halvings of a step.
SHORTER = 40


@dataclass(frozen=True)
class FlatMetric:
    """The result of Newton's method.

    Parameters
    ----------
    u : float (n,)
        Log scale at each vertex.
    lengths : float (m, 3)
        Scaled lengths, opposite to each corner.
    angles : float (m, 3)
        In radians.
    residual : float
        The largest error of an angle sum, in radians.
    history : tuple of float
        The residual at the start and after each step.
    factorisations : int
        Number of factorisations of the Hessian; its pattern was analysed once.

    """

    u: Real
    lengths: Real
    angles: Real
    residual: float
    history: tuple[float, ...]
    factorisations: int
    pattern: BlockPattern
    cholesky: Cholesky

    def laid_out(self, F: Indices, fixed: NDArray[np.bool_], z: Complex) -> Complex:
        """Lay out the flat surface in the plane, by one solve with the analysed pattern.

        `fixed` (n,) marks the vertices whose position is given by z (n,), which must include those
        whose u was held; other values of z are ignored.
        """
        with phase("assembly"):
            weights = half_cotangents_of(self.angles, np.zeros(len(F), dtype=bool))
            A, right = self.pattern.dirichlet(weights, fixed, z)
        self.cholesky.update(A)
        out = z.copy()
        out[self.pattern.kept] = self.cholesky.solve(right)
        return out


def flat_metric(
    F: Indices,
    lengths: Real,
    u: Real,
    held: Indices,
    flat: Real,
    *,
    tolerance: float,
    max_iterations: int,
) -> FlatMetric:
    """Scale vertices so that the angle sums are `flat` (n,) at all vertices but the `held` ones.

    Newton's method on the convex energy of Springborn, Schroeder & Pinkall 2008: its gradient is
    the error of each angle sum, its Hessian the cotangent Laplacian of the scaled lengths. `u` is
    the start, and the held vertices (k,) keep their value.

    Raises
    ------
    AlgorithmFailed
        No vertex is free; the residual is above `tolerance` after `max_iterations`; or triangles
        are broken at the minimum, so that the triangulation has no such metric.

    """
    n = len(u)
    kept = np.ones(n, dtype=bool)
    kept[held] = False
    if not kept.any():
        raise AlgorithmFailed("the scale of every vertex is fixed: the mesh has no interior vertex")
    with phase("assembly"):
        pattern = BlockPattern(F, kept)
    cholesky: Cholesky | None = None
    u = u.copy()
    with phase("angles"):
        alpha, broken = angles(scaled(lengths, F, u))
        gradient = (flat - angle_sums(F, alpha, n))[kept]
    history = [float(np.abs(gradient).max(initial=0.0))]
    while history[-1] > tolerance and len(history) <= max_iterations:
        with phase("assembly"):
            A = pattern.block(half_cotangents_of(alpha, broken))
        cholesky = factor_like(cholesky, A)
        step = np.zeros(n)
        step[kept] = -cholesky.solve(gradient)
        with phase("angles"):
            slope = float(gradient @ step[kept])
            share = 1.0
            for _ in range(SHORTER):
                there, lost = angles(scaled(lengths, F, u + share * step))
                missing = (flat - angle_sums(F, there, n))[kept]
                if float(missing @ step[kept]) <= -UPHILL * slope:
                    break
                share /= 2
        u, alpha, broken, gradient = u + share * step, there, lost, missing
        history.append(float(np.abs(gradient).max()))
    if cholesky is not None:
        # One more step with the last factor, which takes the residual down to rounding for free.
        step = np.zeros(n)
        step[kept] = -cholesky.solve(gradient)
        there, lost = angles(scaled(lengths, F, u + step))
        off = float(np.abs((flat - angle_sums(F, there, n))[kept]).max(initial=0.0))
        if off < history[-1]:
            u, alpha, broken, history[-1] = u + step, there, lost, off
    why = f"the angle sums are still off by up to {history[-1]:.2g} rad, tolerance {tolerance:g}"
    if broken.any():
        raise AlgorithmFailed(
            f"{int(broken.sum())} of {len(F)} triangles cannot keep the triangle inequality: "
            "this triangulation has no flat metric that is discretely conformally equivalent to "
            "its own. Use cetm-flips, which changes the triangulation where needed"
        )
    if history[-1] > tolerance:
        raise AlgorithmFailed(
            f"{why}, after {len(history) - 1} Newton steps. Allow more with max_iterations"
        )
    if cholesky is None:  # already flat
        cholesky = Cholesky(pattern.block(half_cotangents_of(alpha, broken)))
    return FlatMetric(
        u,
        scaled(lengths, F, u),
        alpha,
        history[-1],
        tuple(history),
        len(history),
        pattern,
        cholesky,
    )
