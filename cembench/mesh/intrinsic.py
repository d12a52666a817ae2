"""Intrinsic triangulations: triangles glued along half-edges, with lengths, flipped in place.

Half-edge ``h = 3 t + c`` is the side of triangle t from its corner c to the next. Two triangles may
share several edges, and an edge may be a loop, so end points do not identify an edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import AlgorithmFailed
from cembench.mesh.flips import Independence, distance_across
from cembench.mesh.gluing import twins_of_half_edges
from cembench.mesh.side_lengths import side_lengths

Real = NDArray[np.float64]
Indices = NDArray[np.int64]

#: An edge is flipped if the cosines of its opposite angles sum to less than this.
SURELY = -1e-10
#: Maximal number of rounds; the edges of a round share no triangle.
MOST_ROUNDS = 20_000
#: Small meshes of needles flip for ever, since their angles have no digits: they get fewer.
LEAST_ROUNDS, ROUNDS_AN_EDGE = 1000, 10


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

    """

    F: Indices
    twin: Indices
    log_length: Real
    flips: int = 0

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
        following = np.roll(self.F, -1, axis=1)
        return np.asarray(self.log_length + (u[self.F] + u[following]).ravel() / 2)

    def make_delaunay(self, u: Real, *, flat: bool = False) -> None:
        """Flip edges until all are Delaunay, with vertices scaled by u (n,).

        With `flat` the triangles are Euclidean, and a flipped edge gets the distance of its ends in
        them (u must be 0). Otherwise it gets its length from Ptolemy's rule, which preserves the
        hyperbolic metric with cusps and does not depend on the scaling.

        Raises
        ------
        AlgorithmFailed
            The flips do not end.

        """
        apart = Independence(len(self.F))
        candidates = np.flatnonzero(np.arange(len(self.twin)) < self.twin)
        most = min(MOST_ROUNDS, LEAST_ROUNDS + ROUNDS_AN_EDGE * len(candidates))
        for _ in range(most):
            h = candidates
            h = h[h // 3 != self.twin[h] // 3]
            cosines = self._cosine(h, u) + self._cosine(self.twin[h], u)
            bad = h[cosines < SURELY]
            if not len(bad):
                return
            bad = bad[np.argsort(cosines[cosines < SURELY], kind="stable")]
            chosen = bad[apart(bad // 3, self.twin[bad] // 3)]
            touched = self._flip(chosen, flat=flat)
            rest = np.setdiff1d(bad, chosen, assume_unique=True)
            around = (3 * touched[:, None] + np.arange(3)).ravel()
            candidates = np.unique(np.concatenate([self._moved[rest], around]))
            candidates = np.unique(np.minimum(candidates, self.twin[candidates]))
        raise AlgorithmFailed(f"edges are still being flipped after {most} rounds")

    def _cosine(self, h: Indices, u: Real) -> Real:
        """Return the cosine of the angle opposite to half-edges in Euclidean triangles."""
        t, c = h // 3, h % 3
        corner = u[self.F[t]]
        own = self.log_length.reshape(-1, 3)[t] + (corner + np.roll(corner, -1, axis=1)) / 2
        k = np.arange(len(h))
        e, a, b = (own[k, (c + d) % 3] for d in range(3))
        with np.errstate(over="ignore"):
            return np.asarray((np.exp(a - b) + np.exp(b - a) - np.exp(2 * e - a - b)) / 2)

    def _flip(self, h: Indices, *, flat: bool) -> Indices:
        """Flip edges that share no triangle; return the triangles that changed."""
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
        moved = np.arange(len(self.twin))
        for old, now in ((n2, 3 * t), (m1, 3 * t + 1), (h, 3 * t + 2)):
            moved[old] = now
        for old, now in ((m2, 3 * s), (n1, 3 * s + 1), (g, 3 * s + 2)):
            moved[old] = now
        twin, lengths = np.empty_like(self.twin), np.empty_like(lam)
        twin[moved], lengths[moved] = moved[self.twin], lam
        lengths[3 * t + 2] = lengths[3 * s + 2] = new
        self.F[t] = np.stack([k, i, ell], axis=1)
        self.F[s] = np.stack([ell, j, k], axis=1)
        self.twin, self.log_length, self._moved = twin, lengths, moved
        self.flips += len(h)
        return np.concatenate([t, s])
