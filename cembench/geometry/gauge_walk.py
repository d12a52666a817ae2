"""From a gauge on to Moebius images of less energy, as long as the angles do not suffer.

The conformal energy of a polygon's map depends on its gauge where boundaries are coarse, and so do
the angles, but the least energy is not where the best angles are: a map that only seeks the first
puts where the mesh is coarse into a small part of the disk.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cembench.clock import phase
from cembench.geometry.boundary_energy import EnergyModel, moebius_descent
from cembench.geometry.circle_domain import CircleDomain
from cembench.geometry.dirichlet_to_neumann import DirichletToNeumann

Complex = NDArray[np.complex128]

#: How far a step may go in the unit disk, and how many steps there are at most.
LEASH, STEPS = 0.05, 5
#: A step must lower E_C by this share of itself, and by more than this many times the share by
#: which the angle error grows.
LEAST_GAIN, ANGLE_WEIGHT = 0.002, 20
#: E_C below this is rounding.
ROUNDING = 1e-12


def gauge_walk(
    S: DirichletToNeumann,
    domain: CircleDomain,
    extended: Callable[[Complex], Complex],
    angle_error: Callable[[Complex], float],
    steps: int = STEPS,
) -> tuple[Complex, tuple[float, ...]]:
    """Which Moebius image of this domain has less energy, at hardly any cost to the angles?

    Parameters
    ----------
    S : DirichletToNeumann
        Of the surface.
    domain : CircleDomain
        Where its boundary lies.
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
        E_C of the domain and after each step taken.

    """
    uv, error = extended(domain.points), None
    energies = [_energy(S, domain)]
    for _ in range(steps):
        there = domain.through(moebius_descent(S, domain, LEASH))
        energy = _energy(S, there)
        gain = 1 - energy / energies[-1] if energies[-1] > ROUNDING else 0.0
        if not gain > LEAST_GAIN:
            break
        uv_there = extended(there.points)
        with phase("gauge"):
            error = angle_error(uv) if error is None else error
            error_there = angle_error(uv_there)
        if not gain * error > ANGLE_WEIGHT * (error_there - error):
            break
        domain, uv, error = there, uv_there, error_there
        energies.append(energy)
    return uv, tuple(energies)


def _energy(S: DirichletToNeumann, domain: CircleDomain) -> float:
    return EnergyModel(S, domain, np.zeros(len(domain.arcs))).energy
