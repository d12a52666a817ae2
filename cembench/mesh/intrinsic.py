"""Intrinsic triangulations: triangles glued along half-edges, with lengths, flipped in place.

Half-edge ``h = 3 t + c`` is the side of triangle t from its corner c to the next. Two triangles may
share several edges, and an edge may be a loop, so end points do not identify an edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cembench.core.arrays import Indices, Real
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.flips import Independence, distance_across
from cembench.mesh.gluing import twins_of_half_edges
from cembench.mesh.side_lengths import side_lengths

#: An edge is flipped if the cosines of its opposite angles sum to less than this.
SURELY = -1e-10
#: Maximal number of rounds; the edges of a round share no triangle.
MAX_ROUNDS = 20_000
#: Small meshes of needles flip for ever, since their angles have no digits: they get fewer.
MIN_ROUNDS, ROUNDS_AN_EDGE = 1000, 10


@dataclass
class Triangulation:
    """Triangles glued along half-edges, with the logarithm of each half-edge's length.

    Parameters
    ----------
    F : int64 (m, 3)
        Vertices of the corners.
    twin : int64 (3 m,)
        The twin of each half-edge; there is no boundary.
    log_length : float (3 m,)
        Equal for twins.
    flips : int
        Number of flips so far.
    log : list of int64 arrays, optional
        If there is one, the half-edges that were flipped are added to it, a round at a time.
    """

    F: Indices
    twin: Indices
    log_length: Real
    flips: int = 0
    log: list[Indices] | None = None

    @classmethod
    def doubled(cls, F: Indices, V: Real, mirror: Indices) -> Triangulation:
        """Return a surface with boundary glued to its mirror copy; its own triangles come first.

        `mirror` (n,) gives the copy of each vertex; a boundary vertex is its own copy.
        """
        m = len(F)
        twin = twins_of_half_edges(F)
        h = np.arange(3 * m)
        t, c = h // 3, h % 3
        copy = 3 * (m + t) + 2 - (c + 1) % 3
        both = np.empty(6 * m, dtype=np.int64)
        inside = twin >= 0
        both[h] = np.where(inside, twin, copy)
        both[copy] = np.where(inside, copy[twin], h)
        length = np.roll(side_lengths(V, F), 1, axis=1).ravel()  # side c + 2 starts at corner c
        log_length = np.empty(6 * m)
        log_length[h] = log_length[copy] = np.log(length)
        return cls(np.concatenate([F, mirror[F][:, ::-1]]), both, log_length)

    def scaled(self, u: Real) -> Real:
        """Return the log lengths (3 m,) after scaling vertices by exp(u)."""
        at = u[self.F]
        return np.asarray(self.log_length + (at + at[:, [1, 2, 0]]).ravel() / 2)

    def make_delaunay(self, u: Real, among: Indices | None = None, *, flat: bool = False) -> None:
        """Flip edges until all are Delaunay, with vertices scaled by u (n,).

        `among` (k,) are half-edges, in order and with their twins, that alone may not be Delaunay.

        With `flat` the triangles are Euclidean, and a flipped edge gets the distance of its ends in
        them (u must be 0). Otherwise it gets its length from Ptolemy's rule, which preserves the
        hyperbolic metric with cusps and does not depend on the scaling.

        Raises
        ------
        AlgorithmFailed
            The flips do not end.
        """
        apart = Independence(len(self.F))
        h = np.arange(len(self.twin)) if among is None else among
        h = h[h < self.twin[h]]
        sums = self._cosine(h, u) + self._cosine(self.twin[h], u)
        most = min(MAX_ROUNDS, MIN_ROUNDS + ROUNDS_AN_EDGE * len(self.twin) // 2)
        moved = np.arange(len(self.twin))
        for _ in range(most):
            bad = (sums < SURELY) & (h // 3 != self.twin[h] // 3)
            if not bad.any():
                return
            h = h[bad][np.argsort(sums[bad], kind="stable")]
            flipped = apart(h // 3, self.twin[h] // 3)
            chosen = h[flipped]
            beside = chosen // 3, self.twin[chosen] // 3
            before = np.concatenate([3 * x[:, None] + np.arange(3) for x in beside])
            self._flip(chosen, moved, flat=flat)
            around = np.concatenate([moved[h[~flipped]], before.ravel()])
            moved[before.ravel()] = before.ravel()
            around = np.sort(np.minimum(around, self.twin[around]))
            h = around[np.diff(around, prepend=-1) > 0]
            sums = self._cosine(h, u) + self._cosine(self.twin[h], u)
        raise AlgorithmFailed(f"edges are still being flipped after {most} rounds")

    def _cosine(self, h: Indices, u: Real) -> Real:
        """Return the cosine of the angle opposite to half-edges in Euclidean triangles."""
        t, c = h // 3, h % 3
        corner = u[self.F[t]]
        own = self.log_length.reshape(-1, 3)[t] + (corner + np.roll(corner, -1, axis=1)) / 2
        k = np.arange(len(h))
        e, a, b = (own[k, (c + d) % 3] for d in range(3))
        with np.errstate(over="ignore", invalid="ignore"):  # not a number is no reason to flip
            return np.asarray((np.exp(a - b) + np.exp(b - a) - np.exp(2 * e - a - b)) / 2)

    def _flip(self, h: Indices, moved: Indices, *, flat: bool) -> None:
        """Flip edges that share no triangle; `moved` (3 m,), each at its own place, says where to.

        Half-edges of the triangles that change are found at other places after that.
        """
        if self.log is not None:
            self.log.append(h)
        g = self.twin[h]
        t, s = h // 3, g // 3
        n1, n2 = (3 * t + (h + d) % 3 for d in (1, 2))
        m1, m2 = (3 * s + (g + d) % 3 for d in (1, 2))
        flat_F = self.F.ravel()
        i, j, k, ell = flat_F[h], flat_F[g], flat_F[n2], flat_F[m2]
        lam = self.log_length
        e = lam[h]
        if flat:
            sides = (np.exp(lam[x] - e) for x in (n2, n1, m1, m2))
            new = np.log(distance_across(np.ones(len(h)), *sides)) + e
        else:
            new = np.logaddexp(lam[n2] + lam[m2], lam[n1] + lam[m1]) - e
        old, now = (
            np.concatenate([n2, m1, m2, n1]),
            np.concatenate([3 * t, 3 * t + 1, 3 * s, 3 * s + 1]),
        )
        length, partner = lam[old], self.twin[old]
        moved[old], moved[h], moved[g] = now, 3 * t + 2, 3 * s + 2
        partner = moved[partner]
        self.twin[now], self.twin[partner], lam[now] = partner, now, length
        self.twin[3 * t + 2], self.twin[3 * s + 2] = 3 * s + 2, 3 * t + 2
        lam[3 * t + 2] = lam[3 * s + 2] = new
        self.F[t] = np.stack([k, i, ell], axis=1)
        self.F[s] = np.stack([ell, j, k], axis=1)
        self.flips += len(h)
