"""Moebius images of lower energy, as long as the angles do not suffer.

The conformal energy of a polygon's map depends on its gauge if boundaries are coarse, and so do the
angles. But the least energy does not have the best angles: a map that only minimises energy
squeezes the coarse parts of the mesh into a small part of the disk.
"""

from __future__ import annotations

from collections.abc import Callable

from cembench.conformal.boundary_energy import EnergyModel, moebius_descent
from cembench.core.arrays import Complex
from cembench.core.clock import phase

#: Largest step in the unit disk, and the maximal number of steps.
LEASH, STEPS = 0.05, 5
#: A step must lower E_C by this share, and by more than this many times the relative growth of the
#: angle error.
MIN_GAIN, ANGLE_WEIGHT = 0.0015, 20
#: E_C below this is rounding error.
ROUNDING = 1e-12


def gauge_walk(
    here: EnergyModel,
    extended: Callable[[Complex], Complex],
    angle_error: Callable[[Complex], float],
    steps: int = STEPS,
) -> tuple[Complex, tuple[float, ...]]:
    """Return a Moebius image of a domain that has less energy at hardly any cost to the angles.

    Parameters
    ----------
    here : EnergyModel
        At the domain.
    extended : callable
        Returns the harmonic map (n,) with given boundary values (B,).
    angle_error : callable
        Returns the mean angle error of a map (n,).
    steps : int
        Maximal number of steps.

    Returns
    -------
    uv : complex (n,)
        The map.
    energies : tuple of float
        E_C after each step taken.
    """
    uv, error = extended(here.domain.points), None
    energies: tuple[float, ...] = ()
    for _ in range(steps):
        there = here.at(here.domain.through(moebius_descent(here, LEASH)))
        gain = 1 - there.energy / here.energy if here.energy > ROUNDING else 0.0
        if not gain > MIN_GAIN:
            break
        uv_there = extended(there.domain.points)
        with phase("gauge"):
            error = angle_error(uv) if error is None else error
            error_there = angle_error(uv_there)
        if not gain * error > ANGLE_WEIGHT * (error_there - error):
            break
        here, uv, error = there, uv_there, error_there
        energies += (here.energy,)
    return uv, energies
