"""Points on the unit circle and on the circles of holes inside it: where a boundary may lie.

A boundary vertex is z = c + r exp(i theta), on circle 0 with c = 0 and r = 1. Vertices keep their
order: what is stored are the arcs between neighbours, all positive, 2 pi in sum on each circle, and
every change of a domain leaves them so. Angles grow along the outer loop and fall along those of
holes, since the surface lies on the left of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cembench.errors import AlgorithmFailed
from cembench.geometry.folds import in_order
from cembench.geometry.moebius import Moebius
from cembench.geometry.planar import backward_arcs, fitted_circle, polygon_area

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]

#: What share of its length at the start every arc keeps, so that no two vertices come together.
LEAST_SHARE = 0.1
#: From this arc on (radians) an angle is as exact as what a chord says.
_WIDE = 1.0


@dataclass(frozen=True, eq=False)
class CircleDomain:
    """The vertices of K boundary loops, B in all, on K circles; the outer one comes first.

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
        No change makes an arc shorter than this.

    """

    sizes: tuple[int, ...]
    arcs: Real
    turns: Real
    centres: Complex
    radii: Real
    least: Real

    @classmethod
    def of_arcs(cls, arcs: Real) -> CircleDomain:
        """The unit disk, with such arcs in proportion, all positive, from 1 on; (B,)."""
        arcs = arcs * (2 * np.pi / arcs.sum())
        return cls(
            (len(arcs),), arcs, np.zeros(1), np.zeros(1, complex), np.ones(1), LEAST_SHARE * arcs
        )

    @classmethod
    def of_points(cls, loops: Sequence[Complex]) -> CircleDomain:
        """Which domain comes closest to these boundary loops, the first on the unit circle?

        Circles are fitted to the others. Where vertices of a loop are out of order, they take the
        nearest angles in order.

        Raises
        ------
        AlgorithmFailed
            A loop too far out of order, or one that determines no circle.

        """
        circles = [(0j, 1.0), *(fitted_circle(loop) for loop in loops[1:])]
        arcs, turns = [], []
        for k, (loop, (centre, radius)) in enumerate(zip(loops, circles, strict=True)):
            if not np.isfinite(radius):
                raise AlgorithmFailed(f"the points of boundary loop {k} determine no circle")
            directions = loop - centre
            if not (np.abs(directions) > 0).all():
                raise AlgorithmFailed(f"a vertex of boundary loop {k} lies at its circle's centre")
            directions = directions / np.abs(directions)
            if k:
                directions = np.conj(directions)
            if backward_arcs(directions) or polygon_area(directions) <= 0:
                directions = in_order(directions)
            between = np.angle(np.roll(directions, -1) / directions)
            arcs.append(between * (2 * np.pi / between.sum()))
            turns.append((-1 if k else 1) * np.angle(directions[0]))
        together = np.concatenate(arcs)
        return cls(
            tuple(len(loop) for loop in loops),
            together,
            np.array(turns),
            np.array([centre for centre, _ in circles]),
            np.array([radius for _, radius in circles]),
            LEAST_SHARE * together,
        )

    @property
    def shortest(self) -> NDArray[np.bool_]:
        """Which arcs are as short as they may be? Shape (B,)."""
        return self.arcs <= 1.01 * self.least

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
        return np.where(self.loop == 0, 1.0, -1.0)

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

    def sums(self, values: Real | Complex) -> Real | Complex:
        """Sum over each loop, shape (K,)."""
        return np.add.reduceat(values, self.starts)

    @property
    def apart(self) -> bool:
        """Do the circles of the holes lie inside the unit circle and outside each other?"""
        c, r = self.centres[1:], self.radii[1:]
        between = np.abs(c[:, None] - c) - (r[:, None] + r)
        np.fill_diagonal(between, np.inf)
        return bool((np.abs(c) + r < 1).all() and (between > 0).all() and (r > 0).all())

    def moved(self, along: Real, growth: Real, shift: Complex) -> CircleDomain:
        """Which domain lies in this direction?

        To first order a vertex moves by `along` (B,) in the direction of growing angles, a radius
        by `growth` (K,), a centre by `shift` (K,); those of the outer circle are zero. However long
        the step, no arc falls below the `least`, and no radius below zero: they shrink like exp.
        """
        angle = along / self.radius
        change = self.sense * (angle[self.following] - angle)
        arcs = np.maximum(self.arcs * _growth(change / self.arcs), self.least)
        arcs *= (2 * np.pi / self.sums(arcs))[self.loop]
        radii = self.radii * _growth(growth / self.radii)
        moved = replace(self, arcs=arcs, radii=radii, centres=self.centres + shift)
        # The first vertex turns so that all together turn as they should.
        ahead = self.sense * (_along(moved) - _along(self))
        turns = self.turns + self.sums(angle - ahead) / np.array(self.sizes)
        return replace(moved, turns=turns)

    def through(self, a: complex) -> CircleDomain:
        """Where does the Moebius map (z - a) / (1 - conj(a) z) of the unit disk take this domain?

        Circles go to circles, exactly; arcs below rounding errors of the angles stay exact too.
        """
        if a == 0:
            return self
        phi = Moebius(1, -a, -np.conj(a), 1)
        # Nothing but the circle's centre is its own reflection's image: it goes where infinity goes.
        c, r = self.centres, self.radii
        from_centre = c + r**2 / (1 / a - np.conj(c))
        centres = phi(from_centre)
        centres[0] = 0
        image = phi(self.points)
        radii = np.abs(image[self.starts] - centres)
        radii[0] = 1
        stretch = (1 - abs(a) ** 2) / np.abs(1 - np.conj(a) * self.points) ** 2
        chord = 2 * self.radius * np.sin(self.arcs / 2) * np.sqrt(stretch * stretch[self.following])
        half = np.minimum(chord / (2 * radii[self.loop]), 1.0)
        turned = (image - centres[self.loop]) / radii[self.loop]
        step = np.angle((turned[self.following] / turned) ** self.sense) % (2 * np.pi)
        arcs = np.where((self.arcs < _WIDE) & (half < _WIDE / 2), 2 * np.arcsin(half), step)
        arcs *= (2 * np.pi / np.add.reduceat(arcs, self.starts))[self.loop]
        turns = np.angle(turned[self.starts])
        least = self.least * (arcs / self.arcs)
        return replace(self, arcs=arcs, turns=turns, centres=centres, radii=radii, least=least)


def _along(domain: CircleDomain) -> Real:
    """How far round its circle is each vertex from the first of its loop? Radians."""
    along = np.concatenate([[0.0], np.cumsum(domain.arcs)[:-1]])
    return along - along[domain.starts][domain.loop]


def _growth(t: Real) -> Real:
    """1 + t where that grows, exp(t) where it shrinks: positive, and smooth at 0."""
    return np.where(t < 0, np.exp(np.minimum(t, 0.0)), 1 + t)
