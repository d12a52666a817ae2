"""Splits, collapses and flips of many edges at once, the building blocks of remeshing.

Every operation takes and returns arrays V (n, 3), F (m, 3) of an oriented manifold and works on an
independent set of edges: no two of them touch the same triangle, so their order does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from cembench.core.arrays import Indices, Mask, Real, marked

#: Spacing of the grid that vertices are put on, and where between its points rounding turns: not
#: halfway, where midpoints of edges lie.
GRID, TURN = 2.0**-26, 0.618


def on_grid(V: Real) -> Real:
    """Return vertices rounded to a grid.

    Elementary functions and BLAS differ by their last digits between kinds of processors, and a
    comparison of nearly equal lengths turns that into another mesh. Rounded, all have the same.
    """
    return np.floor(V / GRID + TURN) * GRID


@dataclass(frozen=True)
class Edges:
    """All edges with their triangles.

    `ends` (k, 2) in the direction of the first triangle; `face` and `corner` (k, 2) are the
    triangles and their opposite corners; the second is -1 on the boundary.
    """

    ends: Indices
    face: Indices
    corner: Indices

    @property
    def on_boundary(self) -> Mask:
        """Whether each edge has a single triangle."""
        return self.face[:, 1] < 0

    def rim(self, n: int) -> Mask:
        """Return whether each of the n vertices is on the boundary."""
        return marked(n, self.ends[self.on_boundary])


def edges_of(F: Indices, n: int) -> Edges:
    """Return the edges of the triangles F, with the triangles on each side."""
    m = len(F)
    tail = F[:, [1, 2, 0]].ravel()
    head = F[:, [2, 0, 1]].ravel()
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    new = np.ones(3 * m, dtype=bool)
    new[1:] = ordered[1:] != ordered[:-1]
    first = np.flatnonzero(new)
    twin = np.append(~new[1:], False)[first]
    h0 = order[first]
    h1 = np.where(twin, order[np.minimum(first + 1, 3 * m - 1)], -3)
    return Edges(
        np.stack([tail[h0], head[h0]], axis=1),
        np.stack([h0 // 3, np.where(twin, h1 // 3, -1)], axis=1),
        np.stack([h0 % 3, np.where(twin, h1 % 3, -1)], axis=1),
    )


def boundary_mask(F: Indices, n: int) -> Mask:
    """Whether each of the n vertices is on the boundary."""
    return edges_of(F, n).rim(n)


def compact(V: Real, F: Indices) -> tuple[Real, Indices]:
    """Return the same mesh without unused vertices."""
    used = marked(len(V), F)
    return V[used], (np.cumsum(used) - 1)[F]


def area_vectors(V: Real, F: Indices) -> Real:
    """Return normals of the triangles, with length twice their area; (m, 3)."""
    a, b, c = (V[F[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def vertex_normals(V: Real, F: Indices) -> Real:
    """Return unit normals at the vertices, weighted by area; (n, 3)."""
    N = area_vectors(V, F)
    total = np.stack(
        [
            sum(np.bincount(F[:, c], weights=N[:, d], minlength=len(V)) for c in range(3))
            for d in range(3)
        ],
        axis=1,
    )
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def mean_of_neighbours(V: Real, F: Indices) -> Real:
    """Return the mean of each vertex's neighbours (n, 3); boundary neighbours count half."""
    n = len(V)
    total = np.zeros((n, 3))
    count = np.zeros(n)
    for c in range(3):
        i, j = F[:, c], F[:, (c + 1) % 3]
        for a, b in ((i, j), (j, i)):
            count += np.bincount(a, minlength=n)
            for d in range(3):
                total[:, d] += np.bincount(a, weights=V[b, d], minlength=n)
    return total / np.maximum(count, 1)[:, None]


def _ranks(priority: Real) -> Indices:
    """Return ranks from 1 for the lowest priority; ties are broken by position."""
    ranks = np.empty(len(priority), dtype=np.int64)
    ranks[np.argsort(priority, kind="stable")] = np.arange(1, len(priority) + 1)
    return ranks


def split(
    V: Real, F: Indices, edges: Edges, chosen: Indices, priority: Real
) -> tuple[Real, Indices]:
    """Split those `chosen` edges that have the first `priority` in both of their triangles."""
    rank = _ranks(priority)
    face, corner, ends = edges.face[chosen], edges.corner[chosen], edges.ends[chosen]
    best = np.zeros(len(F) + 1, dtype=np.int64)  # the last entry is for face -1
    for side in range(2):
        np.maximum.at(best, face[:, side], rank)
    best[-1] = 0
    wins = (best[face[:, 0]] == rank) & ((best[face[:, 1]] == rank) | (face[:, 1] < 0))
    face, corner, ends = face[wins], corner[wins], ends[wins]
    middle = len(V) + np.arange(len(ends))
    V = np.concatenate([V, V[ends].mean(axis=1)])
    F, extra = F.copy(), []
    for side in range(2):
        there = face[:, side] >= 0
        t, c, m = face[there, side], corner[there, side], middle[there]
        p, i, j = F[t, c], F[t, (c + 1) % 3], F[t, (c + 2) % 3]
        extra.append(np.stack([p, m, j], axis=1))
        F[t] = np.stack([p, i, m], axis=1)
    return V, np.concatenate([F, *extra])


def collapse(
    V: Real, F: Indices, edges: Edges, chosen: Indices, length: Real, most: int | None = None
) -> tuple[Real, Indices]:
    """Collapse an independent set of the `chosen` edges, the shortest by `length` first.

    An edge stays if its collapse would change the topology, reverse a triangle, or join two
    boundary vertices across the interior. At most `most` edges are collapsed.
    """
    n = len(V)
    bound = edges.rim(n)
    ends, rim = edges.ends[chosen], edges.on_boundary[chosen]
    allowed = rim | ~bound[ends].all(axis=1)
    ends, rim, length = ends[allowed], rim[allowed], length[allowed]
    if not len(ends):
        return V, F
    # Link condition: the ends share exactly the corners opposite to their edge.
    i, j = edges.ends.T
    ones = np.ones(len(i), dtype=np.int32)
    A = scipy.sparse.csr_array((np.r_[ones, ones], (np.r_[i, j], np.r_[j, i])), shape=(n, n))
    shared = np.asarray(A[ends[:, 0]].multiply(A[ends[:, 1]]).sum(axis=1)).ravel()
    good = shared == np.where(rim, 1, 2)
    ends, rim, length = ends[good], rim[good], length[good]
    if not len(ends):
        return V, F
    # Independent: no other chosen edge within one ring of either end.
    rank = _ranks(length)
    nearest = np.full(n, len(rank) + 1)
    for side in range(2):
        np.minimum.at(nearest, ends[:, side], rank)
    around = nearest.copy()
    np.minimum.at(around, i, nearest[j])
    np.minimum.at(around, j, nearest[i])
    wins = (around[ends] == rank[:, None]).all(axis=1)
    ends, rim, rank = ends[wins], rim[wins], rank[wins]
    where = V[ends].mean(axis=1)
    b = bound[ends]
    one = b[:, 0] != b[:, 1]
    where[one] = V[np.where(b[one, 0], ends[one, 0], ends[one, 1])]
    keep = np.flatnonzero(~_spoil_triangles(V, F, ends, where))
    if most is not None:
        keep = keep[np.argsort(rank[keep])[:most]]
    V = V.copy()
    V[ends[keep, 0]] = where[keep]
    target = np.arange(n)
    target[ends[keep, 1]] = ends[keep, 0]
    F = target[F]
    alive = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    return compact(V, F[alive])


def _spoil_triangles(V: Real, F: Indices, ends: Indices, where: Real) -> Mask:
    """Whether edges (k, 2) that collapse to these points reverse a triangle or make slivers."""
    owner = np.full(len(V), -1)
    owner[ends[:, 0]] = owner[ends[:, 1]] = np.arange(len(ends))
    own = owner[F]
    touched = np.flatnonzero((own >= 0).sum(axis=1) == 1)
    T, o = F[touched], own[touched]
    moved = np.where((o >= 0)[:, :, None], where[o], V[T])
    before = area_vectors(V, T)
    after = np.cross(moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0])
    sides = ((moved - np.roll(moved, -1, axis=1)) ** 2).sum(axis=2)
    size = np.linalg.norm(after, axis=1)
    cosine = (before * after).sum(axis=1) / np.maximum(
        np.linalg.norm(before, axis=1) * size, 1e-300
    )
    bad = (cosine < 0.3) | (size < 0.02 * sides.max(axis=1))
    return marked(len(ends), o.max(axis=1)[bad])


def _cotangents(V: Real, p: Indices, i: Indices, j: Indices) -> Real:
    """Return the cotangent at p of the triangle p i j."""
    u, v = V[i] - V[p], V[j] - V[p]
    return (u * v).sum(axis=1) / np.maximum(np.linalg.norm(np.cross(u, v), axis=1), 1e-300)


@dataclass(frozen=True)
class Quads:
    """Interior edges i j with their opposite corners p (in the first triangle) and q."""

    i: Indices
    j: Indices
    p: Indices
    q: Indices
    face: Indices

    def weight(self, V: Real) -> Real:
        """Return cotangent sums, negative if the edge is not Delaunay."""
        return _cotangents(V, self.p, self.i, self.j) + _cotangents(V, self.q, self.j, self.i)

    def flipped_weight(self, V: Real) -> Real:
        """Return the same sums for the other diagonal p q."""
        return _cotangents(V, self.i, self.p, self.q) + _cotangents(V, self.j, self.q, self.p)

    def folds(self, V: Real) -> Mask:
        """Whether the other diagonal would fold the surface."""
        T = (V[self.p], V[self.i], V[self.q], V[self.j])
        old0, old1 = np.cross(T[1] - T[0], T[3] - T[0]), np.cross(T[3] - T[2], T[1] - T[2])
        new0, new1 = np.cross(T[1] - T[0], T[2] - T[0]), np.cross(T[2] - T[0], T[3] - T[0])
        normal = old0 + old1
        size = np.linalg.norm(normal, axis=1)
        folded = np.zeros(len(size), dtype=bool)
        for new in (new0, new1):
            folded |= (new * normal).sum(axis=1) <= 0.2 * np.linalg.norm(new, axis=1) * size
            folded |= np.linalg.norm(new, axis=1) <= 1e-4 * size
        return folded

    def take(self, k: Indices | Mask) -> Quads:
        """Return a selection of them."""
        return Quads(self.i[k], self.j[k], self.p[k], self.q[k], self.face[k])


def quads_of(F: Indices, edges: Edges) -> Quads:
    """Return the two triangles at every interior edge."""
    inner = ~edges.on_boundary
    (i, j), face, corner = edges.ends[inner].T, edges.face[inner], edges.corner[inner]
    return Quads(i, j, F[face[:, 0], corner[:, 0]], F[face[:, 1], corner[:, 1]], face)


def flip(F: Indices, quads: Quads, priority: Real, edges: Edges, n: int) -> tuple[Indices, Indices]:
    """Flip an independent set of edges, highest priority first; also return the changed triangles.

    An edge stays if its other diagonal already is an edge.
    """
    key = np.sort(np.minimum(*edges.ends.T) * n + np.maximum(*edges.ends.T))
    new = np.minimum(quads.p, quads.q) * n + np.maximum(quads.p, quads.q)
    place = np.minimum(np.searchsorted(key, new), len(key) - 1)
    free = (key[place] != new) & (quads.p != quads.q)
    quads, priority, new = quads.take(free), priority[free], new[free]
    rank = _ranks(priority)
    best = np.zeros(len(F), dtype=np.int64)
    for side in range(2):
        np.maximum.at(best, quads.face[:, side], rank)
    wins = (best[quads.face] == rank[:, None]).all(axis=1)
    quads, new = quads.take(wins), new[wins]
    once = np.unique(new, return_index=True)[1]  # two flips must not create the same edge
    quads = quads.take(np.sort(once))
    F = F.copy()
    F[quads.face[:, 0]] = np.stack([quads.p, quads.i, quads.q], axis=1)
    F[quads.face[:, 1]] = np.stack([quads.p, quads.q, quads.j], axis=1)
    return F, quads.face.ravel()


def delaunay_flips(V: Real, F: Indices, rounds: int = 40) -> Indices:
    """Flip edges until (nearly) all are Delaunay: no cotangent weight is negative.

    An edge stays if its flip would fold the surface or duplicate an edge.
    """
    n = len(V)
    # After the first round, only look around the latest changes.
    active, near = np.arange(len(F)), np.ones(n, dtype=bool)
    for _ in range(rounds):
        part = F[active]
        edges = edges_of(part, n)
        quads = quads_of(part, edges)
        weight = quads.weight(V)
        bad = weight < -1e-10
        quads, weight = quads.take(bad), weight[bad]
        # All edges at p must be included, or an existing edge p q could be missed.
        better = near[quads.p] & (quads.flipped_weight(V) > weight + 1e-9) & ~quads.folds(V)
        quads, weight = quads.take(better), weight[better]
        if not len(weight):
            break
        part, changed = flip(part, quads, -weight, edges, n)
        if not len(changed):
            break
        F = F.copy()
        F[active] = part
        near = marked(n, F[active[changed]])
        for _ in range(2):
            near[F[near[F].any(axis=1)]] = True
        active = np.flatnonzero(near[F].any(axis=1))
    return F


def subdivide(V: Real, F: Indices) -> tuple[Real, Indices]:
    """Divide every triangle into four at the midpoints of its edges."""
    edges = edges_of(F, len(V))
    at = np.empty(F.shape, dtype=np.int64)  # the midpoint opposite to each corner
    middle = len(V) + np.arange(len(edges.ends))
    for side in range(2):
        there = edges.face[:, side] >= 0
        at[edges.face[there, side], edges.corner[there, side]] = middle[there]
    a, b, c = at.T
    F = np.concatenate(
        [
            np.stack([F[:, 0], c, b], axis=1),
            np.stack([F[:, 1], a, c], axis=1),
            np.stack([F[:, 2], b, a], axis=1),
            np.stack([a, b, c], axis=1),
        ]
    )
    return np.concatenate([V, V[edges.ends].mean(axis=1)]), F
