"""Capacities of the unit disk with circular holes, to nearly the precision of doubles.

The harmonic function that is 1 on circle i and 0 on all others is a sum of logarithms and negative
powers about each hole's centre, and of powers about 0. Their coefficients are fitted to the values
on the circles, by least squares (Trefethen 2018, Series solution of Laplace problems, ANZIAM
Journal 60). The capacity C_ij is the flux of function i into hole j: - 2 pi times the factor of its
logarithm.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy

from cembench.core.arrays import Complex, Real
from cembench.core.errors import AlgorithmFailed

#: Powers about each centre are doubled until the values on the circles are right to this, or until
#: there are so many unknowns.
PRECISION, MOST = 1e-9, 2000


def circle_capacities(centres: Complex, radii: Real) -> tuple[Real, float]:
    """Return the capacities of the unit disk with circular holes, and their largest error.

    Parameters
    ----------
    centres, radii : complex (k,), float (k,)
        The holes.

    Returns
    -------
    capacities : float (k, k)
        Entry i, j is the integral of the product of the gradients of functions i and j.
    error : float
        Errors are below this share of the diagonal: twice the largest error of a boundary value,
        since fluxes are means of boundary values (maximum principle). It is sampled between the
        fitted points.

    Raises
    ------
    AlgorithmFailed
        Two circles meet.

    Examples
    --------
    >>> C, error = circle_capacities(np.array([0j]), np.array([0.5]))
    >>> bool(abs(C[0, 0] - 2 * np.pi / np.log(2)) < 1e-9), error < 1e-9
    (True, True)
    """
    apart = [
        abs(centres[i] - centres[j]) - radii[i] - radii[j]
        for i, j in combinations(range(len(radii)), 2)
    ]
    if not (np.array([*apart, *(1 - np.abs(centres) - radii), *radii]) > 0).all():
        raise AlgorithmFailed("the circles of the map meet, so they bound no domain")
    powers = 8
    while True:
        C, error = _fitted(centres, radii, powers)
        if error < PRECISION or 4 * powers * (len(radii) + 1) > MOST:
            return C, error
        powers *= 2


def _fitted(centres: Complex, radii: Real, powers: int) -> tuple[Real, float]:
    k, count = len(radii), 4 * powers
    values = np.repeat(np.eye(k + 1)[:, 1:], count, axis=0)
    fitted, between = (_series(centres, radii, powers, count, shift) for shift in (0, 0.5))
    Q, R = scipy.linalg.qr(fitted, mode="economic", overwrite_a=True, check_finite=False)
    coefficients = scipy.linalg.solve_triangular(R, Q.T @ values)
    C = -2 * np.pi * coefficients[:k].T
    return (C + C.T) / 2, 2 * float(np.abs(between @ coefficients - values).max())


def _series(centres: Complex, radii: Real, powers: int, count: int, shift: float) -> Real:
    """Return the values of all terms at points of each circle, the outer one first."""
    turn = np.exp(2j * np.pi * (np.arange(count) + shift) / count)
    k, m = len(radii), np.arange(1, powers + 1)
    centre, radius = np.concatenate([[0], centres]), np.concatenate([[1], radii])
    rows = []
    for c, r in zip(centre, radius, strict=True):
        # Seen from each centre; exact for the circle's own, however small it is.
        off = (c - centre)[:, None] + r * turn
        about = (radii[:, None] / off[1:])[:, :, None] ** m
        terms = np.concatenate([off[:1, :, None] ** m, about])
        terms = terms.transpose(1, 0, 2).reshape(count, (k + 1) * powers)
        logs = np.log(np.abs(off[1:])).T
        rows.append(np.concatenate([logs, np.ones((count, 1)), terms.real, terms.imag], axis=1))
    return np.concatenate(rows)
