"""The types that algorithms return."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cembench.core.arrays import Complex


@dataclass(frozen=True)
class Parameterization:
    """A piecewise linear map from a surface to the complex plane.

    Parameters
    ----------
    uv : complex128 (n,)
        Image of each vertex. Triangles that are counter-clockwise on the surface are
        counter-clockwise in the plane.
    iterations : int
        Number of iterations; 0 for a direct method.
    energy_history : tuple of float
        E_C (Eq. 7) at the start and after each iteration; empty for a direct method.
    extras : dict
        Further results as JSON values. The harness knows some keys: ``energy_of`` names the kind of
        energy if it is not E_C, ``stopped: "crowded"`` marks an iteration that ended early because
        the boundary is too crowded, and ``fold_repairs`` counts the solves that repaired folds;
        these two are reported where the angles are bad. ``folded_before_repair``, the number of
        folded triangles before any repair, is shown beside the metrics. ``alternative`` names
        parameters that may be better here; they are tried outside of the clock, and a notice says
        if they are.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> map_of_itself = cembench.Parameterization(disk.V[:, 0] + 1j * disk.V[:, 1])
    >>> map_of_itself.uv.shape == (disk.n,)
    True
    """

    uv: Complex
    iterations: int = 0
    energy_history: tuple[float, ...] = ()
    extras: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Atlas:
    """A map of a surface cut into islands, with one image point per triangle corner.

    Parameters
    ----------
    corners : complex128 (m, 3)
        Image of each triangle's corners. Two triangles are joined at an edge if both triangles
        have exactly the same image points at its ends.
    extras : dict
        As in :class:`Parameterization`.

    Examples
    --------
    >>> import cembench, numpy as np
    >>> cembench.Atlas(np.array([[0, 1, 1j], [1, 1 + 1j, 1j]])).corners.shape
    (2, 3)
    """

    corners: Complex
    extras: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class MapStep:
    """One step of a method that opens one boundary at a time, for pictures and tables.

    Parameters
    ----------
    sweep : int
        Number of the sweep, from 1.
    boundary : int
        The boundary that became a circle: 0 is the outer one, then the holes, longest first.
    before : complex128 (n,) or None
        The image before the step; None if the step started from the surface itself.
    uv : complex128 (n,)
        The image after the step.
    energies : tuple of float
        E_C before and after each iteration within the step.
    result : complex128 (n,) or None
        The finished map if the method ended here; set only for the last step of a sweep.

    Examples
    --------
    >>> import cembench
    >>> from cembench.algorithms.koebe_cem.steps import shown_steps
    >>> [step.boundary for step in shown_steps(cembench.surface("catenoid-ring", 400))]
    [1, 0]
    """

    sweep: int
    boundary: int
    before: Complex | None
    uv: Complex
    energies: tuple[float, ...]
    result: Complex | None = None
