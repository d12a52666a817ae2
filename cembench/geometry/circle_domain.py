"""Points on the unit circle and on the circles of holes inside it: where a boundary may lie.

A boundary vertex is z = c + r exp(i theta), with c = 0 and r = 1 on the outer circle. Vertices keep
their order: what is stored are the arcs between neighbours, all positive, 2 pi in sum on each
circle, and every change of a domain leaves them so. Angles grow along the outer loop and fall along
those of holes, since the surface lies on the left of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cembench.geometry.moebius import Moebius

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]

#: What share of its length at the start every arc keeps, so that no two vertices come together.
LEAST_SHARE = 0.1
#: From this arc on (radians) an angle is as exact as what a chord says.
_WIDE = 1.0
#: Below this an angle between points of a circle may be rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class CircleDomain:
    """The vertices of K boundary loops, B in all, on K circles, one of which is the outer one.

    Parameters
    ----------
    sizes : tuple of int
        How many vertices lie on each circle.
    arcs : float (B,)
        From each vertex to the next of its loop, radians, positive.
    turns : float (K,)
        Angle of each loop's first vertex.
    centres, radii : complex (K,), float (K,)
        0 and 1 for the outer circle.
    least : float (B,)
        No step makes an arc shorter than this.
    outer : int
        Which is the outer circle.

    """

    sizes: tuple[int, ...]
    arcs: Real
    turns: Real
    centres: Complex
    radii: Real
    least: Real
    outer: int = 0

    @classmethod
    def of_arcs(cls, arcs: Real) -> CircleDomain:
        """The unit disk, with such arcs in proportion, all positive, from 1 on; (B,)."""
        arcs = arcs * (2 * np.pi / arcs.sum())
        return cls(
            (len(arcs),), arcs, np.zeros(1), np.zeros(1, complex), np.ones(1), LEAST_SHARE * arcs
        )

    @property
    def outer_measure(self) -> Real:
        """What share of the unit circle belongs to each vertex? Shape (B,), 0 on holes, 1 in sum.

        Nearly the boundary's harmonic measure from what lies at the origin.
        """
        share = (self.arcs + self.arcs[self.previous]) / (4 * np.pi)
        return np.where(self.loop == self.outer, share, 0.0)

    @property
    def shortest(self) -> NDArray[np.bool_]:
        """Which arcs are as short as they may be? Shape (B,)."""
        return self.arcs <= 1.01 * self.least

    @cached_property
    def holes(self) -> Indices:
        """Which loops are holes? Shape (K - 1,)."""
        return np.delete(np.arange(len(self.sizes)), self.outer)

    @cached_property
    def starts(self) -> Indices:
        """Where each loop begins, shape (K,)."""
        return np.concatenate([[0], np.cumsum(self.sizes)[:-1]]).astype(np.int64)

    @cached_property
    def loop(self) -> Indices:
        """On which loop lies each vertex? Shape (B,)."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)

    @cached_property
    def following(self) -> Indices:
        """Which vertex comes next on its loop? Shape (B,)."""
        after = np.arange(1, len(self.arcs) + 1)
        after[self.starts + np.array(self.sizes) - 1] = self.starts
        return after

    @cached_property
    def previous(self) -> Indices:
        """Which vertex comes before on its loop? Shape (B,)."""
        before = np.empty_like(self.following)
        before[self.following] = np.arange(len(before))
        return before

    @cached_property
    def sense(self) -> Real:
        """1 for the vertices of the outer loop, whose angles grow, -1 for the others."""
        return np.where(self.loop == self.outer, 1.0, -1.0)

    @cached_property
    def radius(self) -> Real:
        """The radius of each vertex's circle, shape (B,)."""
        return self.radii[self.loop]

    @cached_property
    def directions(self) -> Complex:
        """exp(i theta), shape (B,)."""
        along = np.concatenate([[0.0], np.cumsum(self.arcs)[:-1]])
        along -= along[self.starts][self.loop]
        return np.exp(1j * (self.turns[self.loop] + self.sense * along))

    @cached_property
    def points(self) -> Complex:
        """The boundary's image z, shape (B,)."""
        return self.centres[self.loop] + self.radius * self.directions

    def sums(self, values: Real) -> Real:
        """Sum over each loop, shape (K,)."""
        return np.asarray(np.add.reduceat(values, self.starts))

    @property
    def apart(self) -> bool:
        """Do the circles of the holes lie inside the unit circle and outside each other?"""
        c, r = self.centres[self.holes], self.radii[self.holes]
        between = np.abs(c[:, None] - c) - (r[:, None] + r)
        np.fill_diagonal(between, np.inf)
        return bool((np.abs(c) + r < 1).all() and (between > 0).all() and (r > 0).all())

    def moved(self, along: Real, growth: Real, shift: Complex) -> CircleDomain:
        """Which domain lies in this direction?

        To first order a vertex moves by `along` (B,) in the direction of growing angles, a radius
        by `growth` (K,), a centre by `shift` (K,); those of the outer circle are zero. However long
        the step, no arc falls below the `least`, and no radius changes by more than a factor 2.
        """
        angle = along / self.radius
        change = self.sense * (angle[self.following] - angle)
        arcs = self.arcs * _growth(change / self.arcs)
        arcs *= (2 * np.pi / self.sums(arcs))[self.loop]
        spare = np.maximum(arcs - self.least, 0.0)
        arcs = (
            self.least + spare * ((2 * np.pi - self.sums(self.least)) / self.sums(spare))[self.loop]
        )
        radii = self.radii * np.clip(_growth(growth / self.radii), 0.5, 2.0)
        moved = replace(self, arcs=arcs, radii=radii, centres=self.centres + shift)
        # The first vertex turns so that all together turn as they should.
        ahead = self.sense * (_along(moved) - _along(self))
        turns = self.turns + self.sums(angle - ahead) / np.array(self.sizes)
        return replace(moved, turns=turns)

    def towards(self, other: CircleDomain, share: float) -> CircleDomain:
        """The domain on this share of the way to the arcs of another one, on the same circles."""
        return replace(self, arcs=(1 - share) * self.arcs + share * other.arcs)

    def through(self, a: complex) -> CircleDomain:
        """Where does the Moebius map (z - a) / (1 - conj(a) z) of the disk take this domain?"""
        return self._image(Moebius(1, -a, -np.conj(a), 1), self.outer) if a else self

    def inside_out(self, k: int) -> CircleDomain:
        """The same with hole k outside: z goes to r / (z - c), with its centre and radius."""
        return self._image(Moebius(0, self.radii[k], 1, -self.centres[k]), k)

    def _image(self, phi: Moebius, outer: int) -> CircleDomain:
        """The image by a Moebius map that takes the circle `outer` to the unit circle.

        Circles go to circles; arcs stay as exact as they are, however short.
        """
        c, r = self.centres, self.radii
        # The image of a circle has its centre where that goes that the circle reflects to the pole.
        pole = -phi.d / phi.c
        centres = phi(c + r**2 / np.conj(pole - c + (pole == c)) * (pole != c))
        centres[outer] = 0
        image = phi(self.points)
        radii = np.abs(image[self.starts] - centres)
        radii[outer] = 1
        determinant = abs(phi.a * phi.d - phi.b * phi.c)
        stretch = determinant / np.abs(phi.c * self.points + phi.d) ** 2
        chord = 2 * self.radius * np.sin(self.arcs / 2) * np.sqrt(stretch * stretch[self.following])
        half = np.minimum(chord / (2 * radii[self.loop]), 1.0)
        turned = (image - centres[self.loop]) / radii[self.loop]
        moved = replace(
            self, turns=np.angle(turned[self.starts]), centres=centres, radii=radii, outer=outer
        )
        step = (np.angle(turned[self.following] / turned) * moved.sense) % (2 * np.pi)
        short = (self.arcs < _WIDE) & (half < _WIDE / 2)
        small = 2 * np.arcsin(half)
        # A chord belongs to two arcs; rounding may turn one that is nearly 0 into nearly 2 pi.
        small = np.where((step > np.pi) & (small > _ROUNDING), 2 * np.pi - small, small)
        arcs = np.where(short, small, step)
        arcs *= (2 * np.pi / np.add.reduceat(arcs, self.starts))[self.loop]
        return replace(moved, arcs=arcs, least=self.least * (arcs / self.arcs))


def _along(domain: CircleDomain) -> Real:
    """How far round its circle is each vertex from the first of its loop? Radians."""
    along = np.concatenate([[0.0], np.cumsum(domain.arcs)[:-1]])
    return along - along[domain.starts][domain.loop]


def _growth(t: Real) -> Real:
    """1 + t where that grows, exp(t) where it shrinks: positive, and smooth at 0."""
    return np.where(t < 0, np.exp(np.minimum(t, 0.0)), 1 + t)
