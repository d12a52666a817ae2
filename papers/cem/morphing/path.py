"""The path through the surfaces: a cubic spline in time, or a straight line for two."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from cembench.core.arrays import Real


def spline(surfaces: int) -> CubicSpline:
    """Return the natural cubic spline on [0, 1] with the unit vector e_k at knot k.

    A spline is linear in its values, so the positions at time t are ``spline(t) @ positions``,
    and nothing is stored per vertex. With two knots it is a straight line.
    """
    return CubicSpline(np.linspace(0, 1, surfaces), np.eye(surfaces), bc_type="natural")


def position(surfaces: Sequence[Real] | Real, time: float) -> Real:
    """Return the vertices (n, 3) at a time from 0 to 1; `surfaces` are (n, 3) each."""
    total = np.zeros_like(surfaces[0])
    for weight, at in zip(spline(len(surfaces))(time), surfaces, strict=True):
        total += weight * at
    return total


def largest_acceleration(surfaces: Sequence[Real]) -> float:
    """Return the largest acceleration of a vertex, in length over the whole time squared.

    The second derivative of a cubic spline is linear between knots, so the maximum is at a knot.
    """
    knots = np.linspace(0, 1, len(surfaces))
    second = spline(len(surfaces)).derivative(2)
    return max(_longest(second(knot), surfaces) for knot in knots)


def largest_step(surfaces: Sequence[Real], times: Real) -> float:
    """Return the largest movement of a vertex between two frames, in units of length."""
    weights = np.diff(spline(len(surfaces))(times), axis=0)
    return max((_longest(step, surfaces) for step in weights), default=0.0)


def _longest(weights: Real, surfaces: Sequence[Real]) -> float:
    total = sum(w * at for w, at in zip(weights, surfaces, strict=True))
    return float(np.linalg.norm(total, axis=1).max())


def pose_of(points: Real, model: Real, mass: Real, *, scale: bool) -> Callable[[Real], Real]:
    """Return the rigid motion (with a scale, if `scale`) that brings points closest to a model.

    Least squares over corresponding rows of `points` and `model` (k, 3),
    weighted by `mass` (k,): Umeyama 1991. The result can be applied to any points.
    """
    share = mass / mass.sum()
    middle, goal = share @ points, share @ model
    p, q = points - middle, model - goal
    left, sizes, right = np.linalg.svd((share[:, None] * p).T @ q)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    factor = float(sizes @ sign / (share @ (p**2).sum(axis=1))) if scale else 1.0
    turn = left * sign @ right
    return lambda x: factor * (x - middle) @ turn + goal
