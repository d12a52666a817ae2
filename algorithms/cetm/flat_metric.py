"""The flat metric that is discretely conformally equivalent to a surface, by Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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


def descended(
    at: Callable[[Real], tuple[Real, Any, Any]], u: Real, step: Real, along: Real, slope: float
) -> tuple[Real, Real, Any, Any]:
    """Halve a step until the energy does not rise too steeply at its end.

    `at` returns minus the gradient (k,) there, and what else is known; `along` (k,) is the step in
    the same unknowns, `slope` minus the energy's slope at its start. Returns where the step leads,
    and what `at` returns there.
    """
    share = 1.0
    for _ in range(SHORTER):
        there = at(u + share * step)
        if float(there[0] @ along) <= -UPHILL * slope:
            break
        share /= 2
    return u + share * step, *there


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
    history : tuple of float
        The largest error of an angle sum, in radians, at the start and after each step.
    """

    u: Real
    lengths: Real
    angles: Real
    history: tuple[float, ...]
    pattern: BlockPattern
    cholesky: Cholesky

    @property
    def told(self) -> dict[str, float]:
        """What an algorithm tells of it: the last error, and how often one pattern was factored."""
        return {"curvature": self.history[-1], "factorisations": len(self.history)}

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

    def at(u: Real) -> tuple[Real, Real, NDArray[np.bool_]]:
        with phase("angles"):
            alpha, broken = angles(scaled(lengths, F, u))
            return (flat - angle_sums(F, alpha, n))[kept], alpha, broken

    def newton_step(cholesky: Cholesky, gradient: Real) -> Real:
        step = np.zeros(n)
        step[kept] = -cholesky.solve(gradient)
        return step

    gradient, alpha, broken = at(u)
    history = [float(np.abs(gradient).max(initial=0.0))]
    while history[-1] > tolerance and len(history) <= max_iterations:
        with phase("assembly"):
            A = pattern.block(half_cotangents_of(alpha, broken))
        cholesky = factor_like(cholesky, A)
        step = newton_step(cholesky, gradient)
        slope = float(gradient @ step[kept])
        u, gradient, alpha, broken = descended(at, u, step, step[kept], slope)
        history.append(float(np.abs(gradient).max()))
    if cholesky is not None:
        # One more step with the last factor, which takes the residual down to rounding for free.
        there = u + newton_step(cholesky, gradient)
        missing, there_alpha, lost = at(there)
        off = float(np.abs(missing).max(initial=0.0))
        if off < history[-1]:
            u, alpha, broken, history[-1] = there, there_alpha, lost, off
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
    return FlatMetric(u, scaled(lengths, F, u), alpha, tuple(history), pattern, cholesky)
