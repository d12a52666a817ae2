"""From a gauge on to Moebius images of less energy, as long as the angles do not suffer.

The conformal energy of a polygon's map depends on its gauge where boundaries are coarse, and so do
the angles, but the least energy is not where the best angles are: a map that only seeks the first
puts where the mesh is coarse into a small part of the disk.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.boundary_energy import EnergyModel, moebius_descent
from cembench.core.clock import phase

Complex = NDArray[np.complex128]

#: How far a step may go in the unit disk, and how many steps there are at most.
LEASH, STEPS = 0.05, 5
#: A step must lower E_C by this share of itself, and by more than this many times the share by
#: which the angle error grows.
LEAST_GAIN, ANGLE_WEIGHT = 0.0015, 20
#: E_C below this is rounding.
ROUNDING = 1e-12


def gauge_walk(
    here: EnergyModel,
    extended: Callable[[Complex], Complex],
    angle_error: Callable[[Complex], float],
    steps: int = STEPS,
) -> tuple[Complex, tuple[float, ...]]:
    """Which Moebius image of a domain has less energy, at hardly any cost to the angles?

    Parameters
    ----------
    here : EnergyModel
        At the domain.
    extended : function (B,) -> (n,)
        The harmonic map with given boundary values.
    angle_error : function (n,) -> float
        The mean angle error of a map.
    steps : int
        How many there are at most.

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
        if not gain > LEAST_GAIN:
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
