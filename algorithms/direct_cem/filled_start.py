"""A start for maps to the disk with circular holes: the holes are filled, then circles are fitted.

A hole is filled with a round disk, its vertices on the rim in proportion to edge length. That adds
a small dense block, no mesh.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.patches import disk_patch
from cembench.conformal.planar import backward_arcs, polygon_area

from .circle_domain import LEAST_SHARE, CircleDomain, Rims

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: What share of the way to its neighbours' centres, or to the outer circle, a start's radius takes.
ROOM = 0.45
#: With circles smaller than this, other loops are tried as the outer one.
CROWDED = 1e-3


def widest_start(S: DirichletToNeumann, seen: Real, lengths: Sequence[Real]) -> CircleDomain:
    """Which start has loop 0 outside or, where its circles are too small, is the least crowded?

    Along a tube circles shrink by a constant factor with every radius of the tube. What happens at
    circles of radius r adds r^2 to the energy: a loop that leaves the smallest ones larger is then
    the better outside. Arguments as for :func:`filled_start`.
    """
    start = filled_start(S, seen, lengths, 0)
    if start.radii.min() >= CROWDED:
        return start
    others = [filled_start(S, seen, lengths, k) for k in range(1, len(lengths))]
    return max((start, *others), key=lambda domain: domain.radii.min())


def filled_start(
    S: DirichletToNeumann, seen: Real, lengths: Sequence[Real], outer: int
) -> CircleDomain:
    """Where do the boundaries go when the holes are filled?

    Parameters
    ----------
    S : DirichletToNeumann
        Of the surface with its holes open.
    seen : float (B,)
        Harmonic measure of the boundary vertices from what should go near the origin.
    lengths : sequence of float arrays
        Edge lengths along each boundary loop.
    outer : int
        Which loop goes to the unit circle.

    """
    sizes = tuple(len(along) for along in lengths)
    loop = np.repeat(np.arange(len(sizes)), sizes)
    rim, inner = np.flatnonzero(loop == outer), np.flatnonzero(loop != outer)
    unit = np.zeros((len(loop), len(inner)))
    unit[inner, np.arange(len(inner))] = 1
    columns = S(unit)
    filled = columns[inner]
    for k in np.unique(loop[inner]):
        here = np.flatnonzero(loop[inner] == k)
        arcs_here = lengths[k] * (2 * np.pi / lengths[k].sum())
        filled[np.ix_(here, here)] += disk_patch(np.cumsum(arcs_here) - arcs_here)
    to_holes = np.linalg.solve(filled, columns[rim].T)  # minus the harmonic extension
    # What the open holes would swallow goes on to the outer boundary.
    measure = seen[rim] - seen[inner] @ to_holes
    z = np.empty(len(loop), dtype=np.complex128)
    arcs = np.empty(len(loop))
    arcs[rim] = CircleDomain.of_arcs(arcs_of_measure(measure, lengths[outer])).arcs
    z[rim] = np.exp(1j * (np.cumsum(arcs[rim]) - arcs[rim]))
    z[inner] = -(to_holes @ z[rim])
    centres = np.array([z[loop == k].mean() for k in range(len(sizes))])
    radii = np.array([np.sqrt(abs(polygon_area(z[loop == k])) / np.pi) for k in range(len(sizes))])
    turns = np.zeros(len(sizes))
    for k in np.unique(loop[inner]):
        here = loop == k
        about = z[here] - centres[k]
        arcs[here] = _arcs_about(about, lengths[k])
        turns[k] = np.angle(np.sum(about * np.exp(1j * (np.cumsum(arcs[here]) - arcs[here]))))
    holes = np.delete(np.arange(len(sizes)), outer)
    radii[holes] = _with_room(centres[holes], radii[holes])
    centres[outer], radii[outer] = 0, 1
    return CircleDomain(Rims(sizes, outer), arcs, turns, centres, radii, LEAST_SHARE * arcs)


#: Harmonic measure per length is taken for at least this share of its largest value.
LEAST_DENSITY = 1e-12


def arcs_of_measure(measure: Real, lengths: Real) -> Real:
    """Which arcs, up to a factor, have boundary vertices of this harmonic measure?

    A conformal map to the disk gives every piece of the boundary an arc of 2 pi times its harmonic
    measure from what goes to the origin. The measure of a vertex spreads over half of either edge.
    """
    around = (lengths + np.roll(lengths, 1)) / 2
    density = np.maximum(measure / around, LEAST_DENSITY * np.max(measure / around))
    return lengths * (density + np.roll(density, -1))


def _arcs_about(loop: Complex, lengths: Real) -> Real:
    """The arcs of a hole's clockwise image about its centre, or those in proportion to length."""
    if (loop == 0).any() or backward_arcs(np.conj(loop)) or polygon_area(loop) >= 0:
        return lengths * (2 * np.pi / lengths.sum())
    arcs = np.angle(loop / np.roll(loop, -1))
    return arcs * (2 * np.pi / arcs.sum())


def _with_room(centres: Complex, radii: Real) -> Real:
    """Radii no larger than leaves room between the circles."""
    apart = np.abs(centres[:, None] - centres)
    np.fill_diagonal(apart, np.inf)
    room = np.minimum(ROOM * apart.min(axis=1), 0.9 * (1 - np.abs(centres)))
    return np.minimum(radii, room)
