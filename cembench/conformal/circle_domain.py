"""Circle domains: boundary vertices on the unit circle and on the circles of holes inside it.

A boundary vertex is z = c + r exp(i theta), with c = 0 and r = 1 on the outer circle. The vertices
keep their order: the arcs between neighbours are stored, all positive and with sum 2 pi on each
circle, and every change of a domain preserves that. Angles increase along the outer loop and
decrease along the loops of holes, since the surface lies on the left of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cembench.conformal.moebius import Moebius
from cembench.core.arrays import Complex, Indices, Mask, Real

#: Minimal share of its initial length that every arc keeps, so that no vertices meet.
MIN_SHARE = 0.1
#: Arcs below this share of the mean arc are crowded: they hardly change the energy, and the inexact
#: steps of a minimiser leave them to chance.
RESOLVED = 1e-2
#: Share of the room between circles that a step leaves at least.
KEPT = 0.1
#: A half chord below this belongs to a vanishing arc or to nearly the whole circle; the latter only
#: if the arc was longer than a radian before.
_ROUNDING, _WIDE = 1e-9, 1.0


@dataclass(frozen=True, eq=False)
class BoundaryLoops:
    """The assignment of B boundary vertices to K circles, loop by loop; one loop is the outer one.

    Parameters
    ----------
    sizes : tuple of int
        Number of vertices on each circle.
    outer : int
        Index of the outer circle.
    """

    sizes: tuple[int, ...]
    outer: int = 0

    @cached_property
    def holes(self) -> Indices:
        """The indices of the holes, shape (K - 1,)."""
        return np.delete(np.arange(len(self.sizes)), self.outer)

    @cached_property
    def starts(self) -> Indices:
        """The first vertex of each loop, shape (K,)."""
        return np.concatenate([[0], np.cumsum(self.sizes)[:-1]]).astype(np.int64)

    @cached_property
    def loop(self) -> Indices:
        """The loop of each vertex, shape (B,)."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)

    @cached_property
    def on_outer(self) -> Mask:
        """Whether each vertex is on the outer circle, shape (B,)."""
        return self.loop == self.outer

    @cached_property
    def following(self) -> Indices:
        """The next vertex on the same loop, shape (B,)."""
        after = np.arange(1, len(self.loop) + 1)
        after[self.starts + np.array(self.sizes) - 1] = self.starts
        return after

    @cached_property
    def previous(self) -> Indices:
        """The previous vertex on the same loop, shape (B,)."""
        before = np.empty_like(self.following)
        before[self.following] = np.arange(len(before))
        return before

    @cached_property
    def sense(self) -> Real:
        """1 for vertices of the outer loop, whose angles increase, -1 for the others."""
        return np.where(self.on_outer, 1.0, -1.0)

    def sums(self, values: Real) -> Real:
        """Return the sum over each loop, shape (K,)."""
        return np.asarray(np.add.reduceat(values, self.starts))

    def along(self, arcs: Real) -> Real:
        """Return the angle from the first vertex of its loop to each vertex, in radians."""
        along = np.cumsum(arcs) - arcs
        return along - along[self.starts][self.loop] if len(self.sizes) > 1 else along


@dataclass(frozen=True, eq=False)
class CircleDomain:
    """B boundary vertices in K loops on K circles, one of which is the outer one.

    Parameters
    ----------
    rims : BoundaryLoops
        The assignment of vertices to circles.
    arcs : float (B,)
        From each vertex to the next of its loop, in radians, positive.
    turns : float (K,)
        Angle of each loop's first vertex.
    centres, radii : complex (K,), float (K,)
        0 and 1 for the outer circle.
    least : float (B,)
        Minimal length of each arc.
    """

    rims: BoundaryLoops
    arcs: Real
    turns: Real
    centres: Complex
    radii: Real
    least: Real

    @classmethod
    def of_arcs(cls, arcs: Real) -> CircleDomain:
        """Return the unit disk with positive arcs (B,) in these proportions, starting at 1."""
        arcs = arcs * (2 * np.pi / arcs.sum())
        rims, least = BoundaryLoops((len(arcs),)), MIN_SHARE * arcs
        return cls(rims, arcs, np.zeros(1), np.zeros(1, complex), np.ones(1), least)

    @property
    def outer_measure(self) -> Real:
        """Return each vertex's share of the unit circle, shape (B,); 0 on holes, with sum 1.

        This is nearly the boundary's harmonic measure from the point mapped to the origin.
        """
        share = (self.arcs + self.arcs[self.rims.previous]) / (4 * np.pi)
        return np.where(self.rims.on_outer, share, 0.0)

    def shortest(self, most: int) -> Indices:
        """Return the arcs of minimal length; if they are more than `most`, those that matter."""
        shortest = np.flatnonzero(self.arcs <= 1.01 * self.least)
        if len(shortest) > most:
            return shortest[(self.arcs > self._resolved)[shortest]]
        return shortest

    @property
    def _resolved(self) -> Real:
        """The shortest arc that matters on each vertex's circle."""
        return (2 * np.pi * RESOLVED / np.array(self.rims.sizes))[self.rims.loop]

    @cached_property
    def radius(self) -> Real:
        """The radius of each vertex's circle, shape (B,)."""
        return self.radii[self.rims.loop]

    @cached_property
    def directions(self) -> Complex:
        """exp(i theta), shape (B,)."""
        rims = self.rims
        return np.exp(1j * (self.turns[rims.loop] + rims.sense * rims.along(self.arcs)))

    @cached_property
    def points(self) -> Complex:
        """The boundary's image z, shape (B,)."""
        return self.centres[self.rims.loop] + self.radius * self.directions

    @property
    def apart(self) -> bool:
        """Whether the circles of holes lie inside the unit circle and outside each other."""
        c, r = self.centres[self.rims.holes], self.radii[self.rims.holes]
        between = np.abs(c[:, None] - c) - (r[:, None] + r)
        np.fill_diagonal(between, np.inf)
        return bool((np.abs(c) + r < 1).all() and (between > 0).all() and (r > 0).all())

    def apart_from(self, before: CircleDomain) -> CircleDomain:
        """Return the domain with smaller radii where circles meet that were apart before.

        They keep a share :data:`KEPT` of the room that they had.
        """
        now, then = self._room(), before._room()
        factors = np.where(now > 1, 1.0, now / (1 + KEPT * (then - 1))).min(axis=1, initial=1)
        radii = self.radii.copy()
        radii[self.rims.holes] *= factors
        return replace(self, radii=radii)

    def _room(self) -> Real:
        """Return by which factors (h, h) pairs of circles can grow; on the diagonal, each alone."""
        c, r = self.centres[self.rims.holes], self.radii[self.rims.holes]
        room = np.abs(c[:, None] - c) / (r[:, None] + r)
        np.fill_diagonal(room, (1 - np.abs(c)) / r)
        return room

    def moved(self, along: Real, growth: Real, shift: Complex) -> CircleDomain:
        """Return the domain after a step in this direction.

        To first order a vertex moves by `along` (B,) in the direction of increasing angles, a
        radius by `growth` (K,), a centre by `shift` (K,); those of the outer circle are zero.
        However long the step, no arc falls below its `least`, and no radius changes by more than a
        factor of 2.
        """
        rims, angle = self.rims, along / self.radius
        change = rims.sense * (angle[rims.following] - angle)
        arcs = self.arcs * _growth(change / self.arcs)
        arcs *= (2 * np.pi / rims.sums(arcs))[rims.loop]
        spare, room = np.maximum(arcs - self.least, 0.0), 2 * np.pi - rims.sums(self.least)
        arcs = self.least + spare * (room / rims.sums(spare))[rims.loop]
        # The first vertex is rotated so that the mean rotation is as requested.
        ahead = rims.sense * rims.along(arcs - self.arcs)
        turns = self.turns + rims.sums(angle - ahead) / np.array(rims.sizes)
        radii = self.radii * np.clip(_growth(growth / self.radii), 0.5, 2.0)
        return CircleDomain(rims, arcs, turns, self.centres + shift, radii, self.least)

    def towards(self, other: CircleDomain, share: float) -> CircleDomain:
        """Return the domain with arcs moved by this share towards those of `other`."""
        return replace(self, arcs=(1 - share) * self.arcs + share * other.arcs)

    def settled(self, like: CircleDomain) -> CircleDomain:
        """Return the domain with the proportions of another one where its arcs are crowded.

        Arcs that begin within one `RESOLVED` of the mean arc keep their sum. Without crowded arcs
        this is the domain itself.
        """
        rims = self.rims
        cell = np.floor(rims.along(like.arcs) / self._resolved)
        first = np.flatnonzero(np.append(True, (np.diff(cell) != 0) | (np.diff(rims.loop) != 0)))
        if len(first) == len(cell):
            return self
        factors = np.add.reduceat(self.arcs, first) / np.add.reduceat(like.arcs, first)
        return replace(self, arcs=like.arcs * np.repeat(factors, np.diff([*first, len(cell)])))

    def through(self, a: complex) -> CircleDomain:
        """Return the image under the Moebius map (z - a) / (1 - conj(a) z) of the disk."""
        return self._image(Moebius(1, -a, -a.conjugate(), 1), self.rims) if a else self

    def inside_out(self, k: int) -> CircleDomain:
        """Return the domain with hole k outside: z goes to r / (z - c), c and r those of k."""
        return self._image(
            Moebius(0, self.radii[k], 1, -self.centres[k]), replace(self.rims, outer=k)
        )

    def _image(self, phi: Moebius, rims: BoundaryLoops) -> CircleDomain:
        """Return the image by a Moebius map that takes circle `rims.outer` to the unit circle.

        Circles go to circles; arcs keep their relative precision, however short.
        """
        bottom = phi.c * self.points + phi.d
        image = turned = (phi.a * self.points + phi.b) / bottom
        centres, radii = np.zeros_like(self.centres), np.ones_like(self.radii)
        if len(rims.holes):
            # The centre of an image is the image of the pole's reflection in the circle.
            c, r, pole = self.centres, self.radii, -phi.d / phi.c
            mapped = phi(c + r**2 / np.conj(pole - c + (pole == c)) * (pole != c))
            centres[rims.holes] = mapped[rims.holes]
            radii[rims.holes] = np.abs(image[rims.starts] - centres)[rims.holes]
            turned = (image - centres[rims.loop]) / radii[rims.loop]
        # Half a chord and its distance from the centre, whose sign may be lost in rounding.
        next_turned = turned[rims.following]
        stretch = np.sqrt(abs(phi.a * phi.d - phi.b * phi.c)) / np.abs(bottom)
        shrunk = self.radius / radii[rims.loop]
        sine = shrunk * np.sin(self.arcs / 2) * stretch * stretch[rims.following]
        cosine = np.abs(next_turned + turned) / 2
        beyond = (next_turned * np.conj(turned)).imag * rims.sense < 0
        beyond &= (sine > _ROUNDING) | (self.arcs > _WIDE)
        arcs = 2 * np.arctan2(sine, np.where(beyond, -cosine, cosine))
        arcs *= (2 * np.pi / rims.sums(arcs))[rims.loop]
        least = self.least * (arcs / self.arcs)
        return CircleDomain(rims, arcs, np.angle(turned[rims.starts]), centres, radii, least)


def _growth(t: Real) -> Real:
    """Return 1 + t for t >= 0 and exp(t) for t < 0: positive and smooth."""
    return np.where(t < 0, np.exp(np.minimum(t, 0.0)), 1 + t)
