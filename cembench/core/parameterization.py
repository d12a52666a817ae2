"""What an algorithm returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Parameterization:
    """A piecewise linear map from a surface to the complex plane.

    Parameters
    ----------
    uv : complex128 (n,)
        Image of each vertex. Triangles that are counter-clockwise on the surface are
        counter-clockwise in the plane.
    iterations : int
        Iterations that were run; 0 for a direct method.
    energy_history : tuple of float
        E_C (Eq. 7) of the start and after each iteration; empty for a direct method.
    extras : dict
        Whatever else the algorithm has to tell; values that JSON can hold. Where the energies are
        of another kind, ``energy_of`` says of which; ``stopped: "crowded"`` says that an iteration
        ended early because the boundary is too crowded, and ``fold_repairs`` counts the solves that
        laid folds flat: the harness then names this where the angles are bad.

    """

    uv: NDArray[np.complex128]
    iterations: int = 0
    energy_history: tuple[float, ...] = ()
    extras: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Atlas:
    """A map of a surface that was cut into islands: a point for each corner of a triangle.

    Parameters
    ----------
    corners : complex128 (m, 3)
        Image of each triangle's corners. Two triangles hang together at an edge where the images
        of its ends are the same numbers in both.
    extras : dict
        As in :class:`Parameterization`.

    """

    corners: NDArray[np.complex128]
    extras: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class MapStep:
    """One step of a method that opens one boundary at a time, as pictures and tables show it.

    Parameters
    ----------
    sweep : int
        Counted from 1.
    boundary : int
        The boundary that became a circle: 0 the outer one, then the holes, longest first.
    before : complex128 (n,) or None
        The image that the step started from; None where that was the surface itself.
    uv : complex128 (n,)
        The image after the step.
    energies : tuple of float
        E_C before and after each iteration within the step.
    result : complex128 (n,) or None
        The finished map if the method ended here; only after the last step of a sweep.

    """

    sweep: int
    boundary: int
    before: NDArray[np.complex128] | None
    uv: NDArray[np.complex128]
    energies: tuple[float, ...]
    result: NDArray[np.complex128] | None = None
