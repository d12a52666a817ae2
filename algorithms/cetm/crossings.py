"""Where the edges of a mesh cross those of the triangulation that flips make of it.

Each given edge is a path on the flipped triangulation: the list of its edges that it crosses, with
no detour, since both are geodesics of one hyperbolic metric. A flip of the edge ij of the quad
i l j k to kl changes only the crossings inside the quad, and in integers alone: a path crosses kl
if it comes in on the side of i and leaves on that of j.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from cembench.core.arrays import Indices
from cembench.core.errors import AlgorithmFailed

#: No crossing: a path begins or ends at a vertex.
END = -1
#: Crossings that flips may make, so many and so many for each edge: some seconds' worth.
MOST, MAX_OF_AN_EDGE = 2_000_000, 20


@dataclass
class Crossings:
    """Paths of given edges over a triangulation, updated flip by flip.

    Edges have an orientation, that of their first half-edge; a given edge has its own, that of its
    first half-edge before all flips.

    Parameters
    ----------
    F, twin : lists of int
        The triangulation, by half-edges (3 m).
    edge, sign : lists of int
        Each half-edge's edge, and 1 if it runs the same way, else -1.
    """

    F: list[int]
    twin: list[int]
    edge: list[int]
    sign: list[int]
    #: The crossings on each edge, along it; and, for an edge that is a given one, that and 1 if it
    #: runs the same way, else -1.
    on_edge: list[list[int]] = field(default_factory=list)
    along: dict[int, tuple[int, int]] = field(default_factory=dict)
    #: The first crossing of each given edge.
    first: list[int] = field(default_factory=list)
    #: Of each crossing: the one before and after on its given edge, that, the edge it lies on, and
    #: 1 if the given edge comes from the left of that, else -1.
    before: list[int] = field(default_factory=list)
    after: list[int] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    edge_of: list[int] = field(default_factory=list)
    side: list[int] = field(default_factory=list)

    @classmethod
    def none(cls, F: Indices, twin: Indices) -> Crossings:
        """Return the paths before the first flip: every edge is a given one."""
        h = np.arange(len(twin))
        own = np.minimum(h, twin)
        edge = np.unique(own, return_inverse=True)[1]
        count = int(edge.max()) + 1
        return cls(
            F.ravel().tolist(),
            twin.tolist(),
            edge.tolist(),
            np.where(h == own, 1, -1).tolist(),
            on_edge=[[] for _ in range(count)],
            along={e: (e, 1) for e in range(count)},
            first=[END] * count,
        )

    @property
    def first_half_edge(self) -> list[int]:
        """The half-edge along each edge."""
        first = [END] * len(self.on_edge)
        for h, (e, sign) in enumerate(zip(self.edge, self.sign, strict=True)):
            if sign > 0:
                first[e] = h
        return first

    def flip_all(self, rounds: Iterable[Indices]) -> None:
        """Flip edges that are given by half-edges, in rounds that share no triangle.

        Raises
        ------
        AlgorithmFailed
            The paths cross the edges too often.
        """
        most = MOST + MAX_OF_AN_EDGE * len(self.on_edge)
        for some in rounds:
            for h in some.tolist():
                self.flip(h)
                if len(self.before) > most:
                    raise AlgorithmFailed(
                        f"the given edges cross the flipped ones more than {most:,} times on the "
                        "way, so the common refinement is not made"
                    )

    def path(self, given: int) -> list[int]:
        """Return the crossings of a given edge, along it."""
        steps, at = [], self.first[given]
        while at != END:
            steps.append(at)
            at = self.after[at]
        return steps

    def _along(self, h: int) -> list[int]:
        """Return the crossings on a half-edge, along it."""
        there = self.on_edge[self.edge[h]]
        return there if self.sign[h] > 0 else there[::-1]

    def _inside(self, x: int, h: int) -> int:
        """Return the next crossing on the path of x into the triangle of a half-edge with x."""
        return self.before[x] if self.side[x] == self.sign[h] else self.after[x]

    def _leaves(self, x: int, y: int, sides: Sequence[int]) -> int:
        """Return the half-edge, of two, by which a path from x leaves a triangle at y."""
        for h in sides:
            if self.edge_of[y] == self.edge[h] and self._inside(y, h) == x:
                return h
        raise AssertionError("a path leaves a triangle nowhere")

    def flip(self, h: int) -> None:
        """Flip the edge of a half-edge, as :class:`cembench.mesh.intrinsic.Triangulation` does."""
        g = self.twin[h]
        t, s = h // 3, g // 3
        n1, n2 = (3 * t + (h + d) % 3 for d in (1, 2))
        m1, m2 = (3 * s + (g + d) % 3 for d in (1, 2))
        e = self.edge[h]
        crossing = self._across(h, g, (n1, n2), (m1, m2))
        own, runs = self.along.pop(e, (END, 0))
        from_i = runs == self.sign[h]
        for x in self.on_edge[e]:
            self._remove(x, h, e)
        i, j, k, ell = (self.F[x] for x in (h, g, n2, m2))
        old, now = (n2, m1, m2, n1), (3 * t, 3 * t + 1, 3 * s, 3 * s + 1)
        to = dict(zip(old, now, strict=True))
        partners = [to.get(self.twin[x], self.twin[x]) for x in old]
        kept = [(self.edge[x], self.sign[x]) for x in old]
        for x, partner, (edge, sign) in zip(now, partners, kept, strict=True):
            self.twin[x], self.twin[partner] = partner, x
            self.edge[x], self.sign[x] = edge, sign
        self.F[3 * t : 3 * t + 3], self.F[3 * s : 3 * s + 3] = [k, i, ell], [ell, j, k]
        self.twin[3 * t + 2], self.twin[3 * s + 2] = 3 * s + 2, 3 * t + 2
        self.edge[3 * t + 2] = self.edge[3 * s + 2] = e
        self.sign[3 * t + 2], self.sign[3 * s + 2] = 1, -1
        self.on_edge[e] = [
            self._insert(e, *(one if one[3] != END else (END, END, from_i, own)))
            for one in crossing
        ][::-1]

    def _across(
        self, h: int, g: int, one: tuple[int, int], other: tuple[int, int]
    ) -> list[tuple[int, int, bool, int]]:
        """Return the paths that cross the new edge kl, in order from k.

        Each as its crossings on the side of i and on that of j, whether the former comes first, and
        its given edge. An edge ij that is itself a given one is marked by the given edge END.
        """
        (n1, n2), (m1, m2) = one, other
        own = [(END, END, True, END)] if self.edge[h] in self.along else []
        return [
            *self._entering(n2, (h, n1), g, (m1, m2)),
            *self._ending(n1),
            *own,
            *self._ending(m2),
            *self._entering(m1, (g, m2), h, (n2, n1)),
        ]

    def _entering(
        self, side: int, leaving: tuple[int, int], beyond: int, back: tuple[int, int]
    ) -> list[tuple[int, int, bool, int]]:
        """Return the paths of :meth:`_across` that enter the quad by a side on that of i.

        They leave its triangle by ij, the first of `leaving`, or another side. Those over ij leave
        the other triangle, entered by `beyond`, by the sides of `back`; by the first of these they
        stay on the side of i.
        """
        entering = []
        for x in self._along(side):
            y = self._inside(x, side)
            if y != END and self._leaves(x, y, leaving) == leaving[0]:
                on_ij, y = y, self._inside(y, beyond)
                if y == END or self._leaves(on_ij, y, back) == back[0]:
                    continue
            entering.append((x, y, self.side[x] != self.sign[side], self.given[x]))
        return entering

    def _ending(self, side: int) -> list[tuple[int, int, bool, int]]:
        """Return the paths of :meth:`_across` from the opposite corner to a side on that of j."""
        return [
            (END, y, self.side[y] == self.sign[side], self.given[y])
            for y in self._along(side)[::-1]
            if self._inside(y, side) == END
        ]

    def _remove(self, x: int, h: int, e: int) -> None:
        """Take a crossing with the flipped edge out of its path."""
        before, after, segment = self.before[x], self.after[x], self.given[x]
        if before == after == END:  # from k to l or back: the new edge runs from l to k
            self.along[e] = segment, -1 if self.side[x] == self.sign[h] else 1
        self._join(before, after, segment)

    def _join(self, x: int, y: int, given: int) -> None:
        """Let y follow x on a given edge; END for its ends."""
        if x == END:
            self.first[given] = y
        else:
            self.after[x] = y
        if y != END:
            self.before[y] = x

    def _insert(self, e: int, x: int, y: int, x_first: bool, given: int) -> int:
        """Add a crossing with e between x, on the side of i, and y; return it."""
        new = len(self.before)
        for values, value in (
            (self.before, END),
            (self.after, END),
            (self.given, given),
            (self.edge_of, e),
            (self.side, 1 if x_first else -1),
        ):
            values.append(value)
        x, y = (x, y) if x_first else (y, x)
        self._join(x, new, given)
        self._join(new, y, given)
        return new
