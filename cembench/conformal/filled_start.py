"""Initial maps to the disk with circular holes: fill the holes, then fit circles.

A hole is filled with a round disk. The vertices on its rim are spaced by its equilibrium measure:
the flux through it of the potential that is 1 on it and 0 on all other boundaries. On a round hole
of a circle domain that measure is nearly uniform, on a single concentric hole exactly. It also
follows a crowded boundary, for which lengths are no guide. The disk adds a small dense block, and
no mesh.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cembench.conformal.boundary_energy import EnergyModel
from cembench.conformal.circle_domain import MIN_SHARE, BoundaryLoops, CircleDomain
from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.patches import disk_patch
from cembench.conformal.planar import backward_arcs, polygon_area
from cembench.core.arrays import Complex, Real

#: A start's radius as a share of the distance to its neighbours' centres or the outer circle.
ROOM = 0.45
#: If a circle is smaller than this, other loops are tried as the outer one.
CROWDED = 1e-3
#: Of more holes, which are tried takes longer than the map; so these many, of all sizes, are.
ALL_TRIED, MAX_TRIED = 32, 8
#: Minimal share of the mean arc for arcs of a disk that fills a hole: with shorter ones its energy
#: suffers from cancellation, and a start does not depend on them.
PATCH_SHARE = 1e-4


def widest_start(S: DirichletToNeumann, seen: Real, lengths: Sequence[Real]) -> CircleDomain:
    """Return the start with loop 0 outside or, if its circles are too small, the widest start.

    Along a tube, circles shrink by a constant factor per radius of the tube. Details at circles of
    radius r add r^2 to the energy, so a loop that leaves the smallest circles larger is then a
    better outer loop. Arguments as for :func:`filled_start`.
    """
    start = filled_start(S, seen, lengths, 0)
    if start.radii.min() >= CROWDED:
        return start
    holes = np.argsort(start.radii[1:], kind="stable") + 1
    holes = (
        holes[np.linspace(0, len(holes) - 1, MAX_TRIED).round().astype(int)]
        if len(holes) > ALL_TRIED
        else holes
    )
    others = [filled_start(S, seen, lengths, k) for k in np.sort(holes).tolist()]
    return max((start, *others), key=lambda domain: domain.radii.min())


def filled_start(
    S: DirichletToNeumann, seen: Real, lengths: Sequence[Real], outer: int
) -> CircleDomain:
    """Return the circle domain of the boundaries after filling the holes.

    The origin lies near the point whose harmonic measure is `seen`, or among the holes, whichever
    start has the lower E_C: the given point may lie where the surface is crowded.

    Parameters
    ----------
    S : DirichletToNeumann
        Of the surface with its holes open.
    seen : float (B,)
        Harmonic measure of the boundary vertices from a point that may be mapped near the origin.
    lengths : sequence of float arrays
        Edge lengths along each boundary loop.
    outer : int
        The loop that goes to the unit circle.
    """
    rims = BoundaryLoops(tuple(len(along) for along in lengths), outer)
    own = equilibrium_measures(S, rims)
    arcs = np.empty(len(own))
    for k, part in enumerate(_parts(rims)):
        arcs[part] = _of_circle(arcs_of_measure(own[part], lengths[k]))
    rim, inner = np.flatnonzero(rims.on_outer), np.flatnonzero(~rims.on_outer)
    unit = np.zeros((len(own), len(inner)))
    unit[inner, np.arange(len(inner))] = 1
    columns = S(unit)
    filled = columns[inner]
    for k in rims.holes:
        on_rim = np.flatnonzero(rims.loop[inner] == k)
        even = np.maximum(arcs[inner][on_rim], PATCH_SHARE * 2 * np.pi / len(on_rim))
        even = _of_circle(even)
        filled[np.ix_(on_rim, on_rim)] += disk_patch(np.cumsum(even) - even)
    to_holes = np.linalg.solve(filled, columns[rim].T)  # minus the harmonic extension
    domains = []
    for measure in (seen, np.where(rims.on_outer, 0.0, own) / len(rims.holes)):
        # The part that the open holes would absorb goes on to the outer boundary.
        outside = arcs_of_measure(measure[rim] - measure[inner] @ to_holes, lengths[outer])
        domains.append(_fitted(rims, arcs, _of_circle(outside), -to_holes))
    return min(domains, key=lambda domain: EnergyModel(S, domain, domain.outer_measure).energy)


def equilibrium_measures(S: DirichletToNeumann, rims: BoundaryLoops) -> Real:
    """Return the equilibrium measure of each loop, the others at 0; (B,), each of sum 1."""
    potentials = (rims.loop[:, None] == np.arange(len(rims.sizes))).astype(np.float64)
    fluxes = S(potentials)[np.arange(len(rims.loop)), rims.loop]
    return fluxes / rims.sums(fluxes)[rims.loop]


def _parts(rims: BoundaryLoops) -> list[slice]:
    """Return the position of each loop in the boundary."""
    return [slice(a, a + size) for a, size in zip(rims.starts, rims.sizes, strict=True)]


def _of_circle(arcs: Real) -> Real:
    """Return arcs in these proportions with sum 2 pi."""
    return arcs * (2 * np.pi / arcs.sum())


def _fitted(rims: BoundaryLoops, arcs: Real, outside: Real, to_holes: Real) -> CircleDomain:
    """Return the domain with arcs `outside` on the outer circle, and circles fitted to the holes.

    `to_holes` maps values on the outer boundary to the holes' vertices. The centre of a circle is
    the mean of the hole's image in its equilibrium measure. Its arcs are those of the image about
    that centre if they are in order, else those of the measure. Radius and rotation are least
    squares fits.
    """
    arcs, z = arcs.copy(), np.empty(len(arcs), dtype=np.complex128)
    arcs[rims.on_outer] = outside
    z[rims.on_outer] = np.exp(1j * (np.cumsum(outside) - outside))
    z[~rims.on_outer] = to_holes @ z[rims.on_outer]
    centres, similarities = np.zeros(len(rims.sizes), complex), np.ones(len(rims.sizes), complex)
    for k in rims.holes:
        own = _parts(rims)[k]
        image, along = z[own], arcs[own]
        centres[k] = (along + np.roll(along, 1)) @ image / (4 * np.pi)
        along = arcs[own] = _arcs_about(image - centres[k], along)
        circle = np.exp(-1j * (np.cumsum(along) - along))
        similarities[k] = (along + np.roll(along, 1)) @ ((image - centres[k]) * circle.conj())
    radii = np.abs(similarities) / (4 * np.pi)
    radii[rims.outer] = 1
    radii[rims.holes] = _radii_without_overlap(centres[rims.holes], radii[rims.holes])
    return CircleDomain(rims, arcs, np.angle(similarities), centres, radii, MIN_SHARE * arcs)


#: Harmonic measure per length is raised to at least this share of its largest value.
MIN_DENSITY = 1e-12


def arcs_of_measure(measure: Real, lengths: Real) -> Real:
    """Return the arcs, up to a factor, of boundary vertices with this harmonic measure.

    A conformal map to the disk gives every piece of the boundary an arc of 2 pi times its harmonic
    measure from the point mapped to the origin. A vertex's measure is spread over half of each
    edge.
    """
    around = (lengths + np.roll(lengths, 1)) / 2
    density = np.maximum(measure / around, MIN_DENSITY * np.max(measure / around))
    return lengths * (density + np.roll(density, -1))


def _arcs_about(loop: Complex, otherwise: Real) -> Real:
    """Return the arcs of a hole's clockwise image about its centre if in order, or `otherwise`."""
    if (loop == 0).any() or backward_arcs(np.conj(loop)) or polygon_area(loop) >= 0:
        return otherwise
    return _of_circle(np.angle(loop / np.roll(loop, -1)))


def _radii_without_overlap(centres: Complex, radii: Real) -> Real:
    """Return radii reduced until there is room between the circles."""
    apart = np.abs(centres[:, None] - centres)
    np.fill_diagonal(apart, np.inf)
    room = np.minimum(ROOM * apart.min(axis=1), 0.9 * (1 - np.abs(centres)))
    return np.minimum(radii, room)
