"""Minimise the conformal energy over the boundary where a product with S costs a solve.

A Newton step takes several products with the Hessian. Here a step takes one, the one that gives
energy and gradient at its end: the inverse Hessian is the preconditioner, corrected by the
differences of the gradients seen so far (limited-memory BFGS; Nocedal 1980).
"""

from __future__ import annotations

from cembench.conformal.boundary_energy import ROUNDING, EnergyModel, Minimum, in_gauge
from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed

#: With more steps than this the boundary's dense triangle would have been cheaper.
MAX_STEPS = 8
#: A step must lower the energy by this share of what was predicted.
MIN_AGREEMENT = 0.25


def quasi_newton_minimum(
    here: EnergyModel, *, tolerance: float, max_iterations: int
) -> Minimum | None:
    """Minimise the conformal energy from `here` on, in its gauge.

    Ends when E_C can decrease by at most the share `tolerance`. Returns None if a step lowers E_C
    by much less than predicted, if an arc would have to be held, or if :data:`MAX_STEPS` steps do
    not suffice; :func:`minimise` is for these boundaries.
    """
    energies, pairs = [here.energy], list[tuple[Real, Real]]()
    while True:
        if len(here.held):
            return None
        with phase("boundary step"):
            step = -_uphill(here, pairs)
        predicted = -0.5 * float(here.gradient @ step)
        can_fall = max(predicted, 0.5 * here.gradient_norm**2)
        if can_fall <= tolerance * here.energy:
            reason = "gradient"
        elif len(energies) > max_iterations:
            reason = "iterations"
        elif not predicted >= ROUNDING * len(here.weights):
            reason = "rounding"
        elif len(energies) > MAX_STEPS:
            return None
        else:
            try:
                there = here.at(in_gauge(here.moved(step), here.weights))
            except AlgorithmFailed:
                return None
            if not here.energy - there.energy > MIN_AGREEMENT * predicted:
                return None
            pairs.append((step, there.gradient - here.gradient))
            if not float(step @ pairs[-1][1]) > 0:  # no minimum in sight
                return None
            here = there
            energies.append(here.energy)
            continue
        norm = (2 * can_fall) ** 0.5
        return Minimum(here, tuple(energies), norm, reason, 0, 0)


def _uphill(here: EnergyModel, pairs: list[tuple[Real, Real]]) -> Real:
    """Return the gradient times the inverse Hessian, by the two loops of limited-memory BFGS."""
    if not pairs:
        return here.uphill
    q, shares = here.gradient, []
    for step, change in reversed(pairs):
        shares.append(float(step @ q) / float(step @ change))
        q = q - shares[-1] * change
    x = here.precondition(q)
    for (step, change), share in zip(pairs, reversed(shares), strict=True):
        x = x + (share - float(change @ x) / float(step @ change)) * step
    return x
