"""The intrinsic Delaunay triangulation of a surface, by edge flips on lengths alone.

Own code, because libigl's flips do not end on thin triangles, where rounding makes both an edge and
its replacement look wrong, and then use up all memory. Here an edge is flipped only if rounding
cannot be the reason, and the flips of a round share no triangle, so all are made at once.

Corners are numbered consecutively: corner ``3 t + c`` is at vertex ``F[t, c]``, and also stands for
the opposite edge.
"""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices, Mask, Real, marked
from cembench.mesh.flips import Independence, area_of_sides, distance_across
from cembench.mesh.gluing import opposite_edge_ends, partners

#: An edge is not Delaunay if its cotangents sum to less than minus this share of their size.
ROUNDING = 1e-10
#: The corner after each one of a triangle, and round again.
NEXT = np.array([1, 2, 0, 1])
#: Maximal rounds of flips; a real surface takes about ten.
MAX_ROUNDS = 1000
#: Up to this share of obtuse angles, the edges opposite to them are examined alone first.
FEW = 0.02


def intrinsic_delaunay(F: Indices, lengths: Real, weights: Real) -> tuple[Indices, Real, Real]:
    """Flip edges until all are Delaunay: their opposite angles sum to at most 180 degrees.

    Parameters
    ----------
    F : int (m, 3)
        Triangles of an oriented manifold, counter-clockwise.
    lengths : float (m, 3)
        Length of the edge opposite to each corner.
    weights : float (m, 3)
        Half the cotangent of the angle at each corner.

    Returns
    -------
    F, lengths, weights
        The same for the new triangles, whose straight edges cross the old ones. Two of them may
        share several edges, and a triangle may meet itself.

    References
    ----------
    .. [1] Fisher, Springborn, Schroeder, Bobenko, "An algorithm for the construction of intrinsic
           Delaunay triangulations with applications to digital geometry processing",
           Computing 81, 2007.
    """
    obtuse = np.count_nonzero(weights < 0)
    if not obtuse:
        return F, lengths, weights
    if obtuse <= FEW * weights.size:
        wrong = _at_wrong_edges(F, lengths, weights)
        if not len(wrong):
            return F, lengths, weights
        flipped = _flipped_near(wrong, F, lengths, weights)
        if flipped is not None:
            return flipped
    whole = _Corners(F, lengths, weights)
    whole.flip_all()
    return whole.triangles()


def _at_wrong_edges(F: Indices, lengths: Real, weights: Real) -> Indices:
    """Return the triangles at edges that must be flipped, found from the obtuse angles alone."""
    near = np.flatnonzero(opposite_to_obtuse(F, weights))
    part = _Corners(F[near], lengths[near], weights[near])
    wrong = part.not_delaunay(part.obtuse())
    return np.asarray(near[np.concatenate([wrong, part.twin[wrong]]) // 3])


def _flipped_near(
    wrong: Indices, F: Indices, lengths: Real, weights: Real
) -> tuple[Indices, Real, Real] | None:
    """Flip with only the triangles near these at hand; None where flips lead farther away."""
    inside = marked(int(F.max()) + 1, F[wrong])
    inside[F[_with_one_of(inside, F)]] = True
    near = np.flatnonzero(_with_one_of(inside, F))
    part = _Corners(F[near], lengths[near], weights[near])
    if not part.flip_all(inside):
        return None
    F, lengths, weights = F.copy(), lengths.copy(), weights.copy()
    F[near], lengths[near], weights[near] = part.triangles()
    return F, lengths, weights


def _with_one_of(inside: Mask, F: Indices) -> Mask:
    """Return a mask (m,) of the triangles with a vertex of these."""
    first, second, third = inside.take(F).T
    return np.asarray(first | second | third)


def opposite_to_obtuse(F: Indices, weights: Real) -> Mask:
    """Return a mask (m,) of triangles that has both at every edge opposite to an obtuse angle.

    Only these edges may not be Delaunay. `weights` (m, 3) have the signs of the cotangents.
    """
    of_edge = np.zeros(int(F.max()) + 1, dtype=bool)
    _, *others = _following(np.flatnonzero(weights < 0))
    for corner in others:
        of_edge[F.ravel()[corner]] = True
    # A triangle at such an edge has both of its ends.
    return np.asarray(np.count_nonzero(of_edge[F], axis=1) >= 2)


class _Corners:
    """Data at each corner of each triangle; arrays (3 m,), changed by flips."""

    def __init__(self, F: Indices, lengths: Real, weights: Real) -> None:
        self.vertex: Indices = F.flatten()
        self.length: Real = lengths.flatten()
        self.weight: Real = weights.flatten()
        self.twin = partners(*opposite_edge_ends(F))
        self._apart = Independence(len(F))
        self._moved_to = np.empty(F.size, dtype=np.int64)

    def triangles(self) -> tuple[Indices, Real, Real]:
        """Return vertices, lengths and weights (m, 3)."""
        return self.vertex.reshape(-1, 3), self.length.reshape(-1, 3), self.weight.reshape(-1, 3)

    def obtuse(self) -> Indices:
        """Return the corners, one at least of every edge that may have to be flipped."""
        return np.flatnonzero(self.weight < 0)

    def flip_all(self, inside: Mask | None = None) -> bool:
        """Flip until no edge is wrong; False, and not at the end, at a vertex not `inside`."""
        waiting = self.obtuse()
        for _ in range(MAX_ROUNDS):
            wrong = self.not_delaunay(waiting)
            if not len(wrong):
                break
            flipped = self.sharing_no_triangle(wrong)
            touched = self.flip(wrong[flipped])
            if inside is not None and not inside[self.vertex.reshape(-1, 3)[touched // 3]].all():
                return False
            waiting = np.concatenate([wrong[~flipped], touched])
        return True

    def not_delaunay(self, corners: Indices) -> Indices:
        """Return the corners whose edge is not Delaunay, the lower one of each edge's two."""
        twins = self.twin.take(corners)
        one, other = self.weight.take(corners), self.weight.take(twins)  # of -1: the last one
        negative = np.flatnonzero((one + other < 0) & (twins >= 0))
        corners, twins = corners.take(negative), twins.take(negative)
        one, other = one.take(negative), other.take(negative)
        wrong = one + other < -ROUNDING * (np.abs(one) + np.abs(other))
        corners, twins = corners[wrong], twins[wrong]
        wrong = corners // 3 != twins // 3  # such an edge cannot be flipped
        lower = np.sort(np.minimum(corners, twins)[wrong], kind="stable")
        return lower[np.diff(lower, prepend=-1) > 0]

    def sharing_no_triangle(self, corners: Indices) -> Mask:
        """Whether, of these edges one after another, no earlier one has the same triangle."""
        return self._apart(corners // 3, self.twin[corners] // 3)

    def flip(self, corners: Indices) -> Indices:
        """Flip these edges, of triangles (k, i, j) and (h, j, i); the corners of their outer edges.

        Edge ij becomes kh: the triangles become (k, i, h) and (h, j, k).
        """
        k, h = corners, self.twin.take(corners)
        (s, i, j), (t, j2, i2) = _following(k), _following(h)
        # Outer edges ih, jk, ki and hj: where they are, and where they go.
        old, new = np.concatenate([j2, i, j, i2]), np.concatenate([s, t, s + 2, t + 2])
        lengths, partners = self.length.take(old), self.twin.take(old)
        ih, jk, ki, hj = lengths.reshape(4, -1)
        diagonal = distance_across(self.length.take(k), ki, jk, ih, hj)
        at_k, at_h, at_i, at_j = (self.vertex.take(x) for x in (k, h, i, j))
        self._moved_to[partners] = partners
        self._moved_to[old] = new
        partners = np.where(partners >= 0, self._moved_to.take(partners), -1)
        inside = partners >= 0
        self.twin[new] = partners
        self.twin[partners[inside]] = new[inside]
        self.twin[s + 1], self.twin[t + 1] = t + 1, s + 1
        first = new[: 2 * len(k)]
        sides = lengths[: 2 * len(k)], np.tile(diagonal, 2), lengths[2 * len(k) :]
        vertices = (at_k, at_h), (at_i, at_j), (at_h, at_k)
        for c, weight in enumerate(_half_cotangents(*sides)):
            self.vertex[first + c] = np.concatenate(vertices[c])
            self.length[first + c], self.weight[first + c] = sides[c], weight
        return new


def _half_cotangents(a: Real, b: Real, c: Real) -> list[Real]:
    """Return half the cotangents opposite to the sides a, b, c (m,) each."""
    eightfold = 8 * area_of_sides(a, b, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        return [
            (y * y + (z - x) * (z + x)) / eightfold for x, y, z in ((a, b, c), (b, c, a), (c, a, b))
        ]


def _following(corner: Indices) -> tuple[Indices, Indices, Indices]:
    """Return the first corner of the same triangle, and the two that follow this one."""
    place = corner % 3
    first = corner - place
    return first, first + NEXT.take(place), first + NEXT.take(place + 1)
