"""Triangles glued along chosen pairs of sides, and separate everywhere else.

A triangulation is a list of triangles and a list of pairs of sides that are glued. Omitting a pair
cuts the surface there. Since a side is glued to at most one other, every vertex has a single fan.
So one function splits non-manifold vertices and edges, and cuts a surface open.

Half-edge ``h = 3 t + c`` is the side of triangle ``t`` from corner ``h`` to the next corner of the
triangle, as in :mod:`cembench.mesh.topology`.
"""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices
from cembench.mesh.topology import half_edges, linked

#: Places a vertex has in a table of the edges to later vertices, about three on average.
SLOTS = 8


def edges_of_half_edges(F: Indices) -> tuple[Indices, Indices, Indices]:
    """Return the edges (e, 2), each half-edge's edge (3m,) and each edge's face count (e,)."""
    ends = np.sort(half_edges(F), axis=1)
    stride = int(F.max(initial=0)) + 1
    keys, edge, faces = np.unique(
        ends[:, 0] * stride + ends[:, 1], return_inverse=True, return_counts=True
    )
    return np.stack([keys // stride, keys % stride], axis=1), edge.reshape(-1), faces


def paired_half_edges(edge: Indices, faces: Indices) -> Indices:
    """Return the two half-edges of every edge with exactly two faces, (k, 2), by edge."""
    order = np.argsort(edge, kind="stable")
    return order[faces[edge[order]] == 2].reshape(-1, 2)


def twins_of_half_edges(F: Indices) -> Indices:
    """Return the half-edge on the other side of each one of an oriented manifold; -1: boundary."""
    return partners(F.ravel(), F[:, [1, 2, 0]].ravel())


def opposite_edge_ends(F: Indices) -> tuple[Indices, Indices]:
    """Return the ends (3 m,) each of the edges opposite to the corners, in F's order."""
    after, before = (F.take(c, axis=1).ravel() for c in ((1, 2, 0), (2, 0, 1)))  # beats F[:, c]
    return after, before


def partners(i: Indices, j: Indices) -> Indices:
    """Return which other edge has the ends of each edge ij, in either order; -1 where none has.

    i and j are integers of one type (k,), which must hold :data:`SLOTS` times their values. No more
    than two edges have the same ends.
    """
    partner = np.full(len(i), -1)
    _pair_opposite(i, j, partner)
    # What runs the same way, lost its place in the table, or has no partner.
    rest = np.flatnonzero(partner < 0)
    i, j = i.take(rest).astype(np.int64), j.take(rest).astype(np.int64)
    keys = np.minimum(i, j) * (max(i.max(initial=0), j.max(initial=0)) + 1) + np.maximum(i, j)
    order = np.argsort(keys, kind="stable")
    keys, rest = keys[order], rest[order]
    same = np.flatnonzero(keys[1:] == keys[:-1])
    one, other = rest[same], rest[same + 1]
    partner[one], partner[other] = other, one
    return partner


def _pair_opposite(i: Indices, j: Indices, partner: Indices) -> None:
    """Enter in `partner` most pairs of edges ij and ji, faster than by sorting.

    An edge's place in a table is given by its lower vertex and the last bits of the other one;
    where two have the same place, one is lost.
    """
    up, down = np.flatnonzero(i < j), np.flatnonzero(i > j)
    if not len(up):
        return
    low, high = i.take(up), j.take(up)
    table = np.zeros((int(low.max()) + 1) * SLOTS, dtype=np.int32)
    table[low * SLOTS + high % SLOTS] = up
    low, high = j.take(down), i.take(down)
    match = table.take(np.minimum(low * SLOTS + high % SLOTS, len(table) - 1))
    equal = (i.take(match) == low) & (j.take(match) == high)
    match, down = match[equal], down[equal]
    partner[match], partner[down] = down, match


def glue(F: Indices, pairs: Indices, n: int) -> tuple[Indices, Indices]:
    """Glue triangles along these pairs of half-edges (k, 2), and nowhere else.

    Returns
    -------
    F : int64 (m, 3)
        The triangles in the same order, with new vertices.
    origin : int64 (n',)
        The input vertex that each new vertex is a copy of. Input vertex i stays vertex i, with one
        of its fans; the copies for its other fans are numbered from `n` on.
    """
    corner = np.arange(F.size).reshape(F.shape)
    following = np.roll(corner, -1, axis=1).ravel()
    vertex = F.ravel()
    left, right = pairs.T
    alike = vertex[left] == vertex[right]  # both run the same way: orientations disagree
    start = np.where(alike, right, following[right])
    end = np.where(alike, following[right], right)
    i, j = np.concatenate([left, following[left]]), np.concatenate([start, end])
    _, fan = linked(i, j, F.size)
    first = np.unique(fan, return_index=True)[1]  # one corner of each fan
    owner = vertex[first]
    order = np.lexsort((first, owner))
    is_copy = np.zeros(len(owner), dtype=bool)
    is_copy[order[1:]] = owner[order[1:]] == owner[order[:-1]]
    number = owner.copy()
    copies = order[is_copy[order]]
    number[copies] = n + np.arange(len(copies))
    return number[fan].reshape(F.shape), np.concatenate([np.arange(n), owner[copies]])


def vertices_of_several_fans(F: Indices, n: int) -> Indices:
    """Return the vertices whose triangles form more than one fan, ascending.

    The triangles at a vertex form fans: each is glued along the edges at the vertex, and is a
    cycle, or a sequence between two boundary edges.

    The triangles (m, 3) have three different corners each and a consistent orientation, and no edge
    has more than two of them. From one half-edge of every vertex, the first of its fan if that has
    an end, all vertices turn counter-clockwise together; a single fan has all corners of its
    vertex.
    """
    twin = twins_of_half_edges(F).reshape(-1, 3)
    # The side that ends at a vertex, seen from the other triangle, starts there.
    turned = twin[:, [2, 0, 1]].ravel()
    tails = F.ravel()
    first = np.full(n, -1)
    first[tails] = np.arange(F.size)
    ends = np.flatnonzero(twin.ravel() < 0)
    first[tails[ends]] = ends
    unseen = np.bincount(tails, minlength=n)
    vertex = np.flatnonzero(first >= 0)
    at = start = first[vertex]
    while len(vertex):
        unseen[vertex] -= 1
        at = turned[at]
        goes_on = (at >= 0) & (at != start)
        vertex, at, start = vertex[goes_on], at[goes_on], start[goes_on]
    return np.flatnonzero(unseen)
