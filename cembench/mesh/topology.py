"""Combinatorics of an oriented triangulation, vectorised; coordinates play no role.

F is an int64 (m, 3) array of vertex indices. Half-edge ``c`` of face ``t`` runs from ``F[t, c]`` to
``F[t, (c + 1) % 3]`` and has its face on the left. `boundary_loops` requires what
:class:`~cembench.mesh.triangle_mesh.TriangleMesh` guarantees: a consistently oriented 2-manifold.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from cembench.core.arrays import Indices


def half_edges(F: Indices) -> Indices:
    """Return the directed edges (3m, 2) of the faces; rows 3t, 3t+1, 3t+2 belong to face t."""
    return F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def undirected_edges(F: Indices) -> tuple[Indices, Indices]:
    """Return the edges (e, 2), smaller index first, and the face count of each (e,)."""
    ends = np.sort(half_edges(F), axis=1)
    stride = int(F.max()) + 1
    keys, faces = np.unique(ends[:, 0] * stride + ends[:, 1], return_counts=True)
    return np.stack([keys // stride, keys % stride], axis=1), faces


def repeated_half_edges(F: Indices) -> Indices:
    """Return the directed edges of more than one face; none if orientations agree."""
    stride = int(F.max()) + 1
    keys = (F * stride + F[:, [1, 2, 0]]).ravel()
    keys.sort()
    keys = np.unique(keys[1:][keys[1:] == keys[:-1]])
    return np.stack([keys // stride, keys % stride], axis=1)


def vertex_graph(F: Indices, n: int) -> scipy.sparse.csr_array:
    """Return the adjacency matrix (n, n) of the vertices; its values are meaningless."""
    i, j = half_edges(F).T
    ones = np.ones(len(i))
    return scipy.sparse.coo_array(
        (np.r_[ones, ones], (np.r_[i, j], np.r_[j, i])), shape=(n, n)
    ).tocsr()


def components(F: Indices, n: int) -> tuple[int, Indices]:
    """Return the number of connected components of triangles or edges, and that of each vertex."""
    # Two sides connect the corners of a triangle, one the ends of an edge.
    return linked(np.repeat(F[:, 0], F.shape[1] - 1), F[:, 1:].ravel(), n)


def linked(i: Indices, j: Indices, n: int) -> tuple[int, Indices]:
    """Return the number of pieces of n points that are linked in pairs i, j, and that of each."""
    graph = scipy.sparse.coo_array((np.ones(len(i), dtype=bool), (i, j)), shape=(n, n))
    count, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    return int(count), labels.astype(np.int64)


def first_of_linked(i: Indices, j: Indices, n: int) -> Indices:
    """Return the first point of the piece of each of n points that are linked in pairs i, j."""
    _, piece = linked(i, j, n)
    return np.unique(piece, return_index=True)[1][piece]


def euler_characteristic(F: Indices, n: int) -> int:
    """Return V - E + F: 1 for a disk, 2 for a sphere, 2 - 2 g - b in general."""
    return n - len(undirected_edges(F)[0]) + len(F)


def genus(F: Indices, n: int, loops: Sequence[Indices]) -> int:
    """Return the genus of a connected oriented surface with these boundary loops.

    Each of its E edges has two half-edges, or one on the boundary, so no edges need be sorted.
    """
    edges = (F.size + sum(map(len, loops))) // 2
    return (2 - len(loops) - (n - edges + len(F))) // 2


def boundary_half_edges(F: Indices, n: int) -> Indices:
    """Return the half-edges (k, 2) without a twin.

    Around an interior vertex every neighbour is once the next corner of a face and once the
    previous one, so the sum of (next - previous) vanishes; on the boundary it is the difference of
    two distinct vertices. This finds the boundary without sorting any edges.
    """
    imbalance = np.zeros(n)
    for c in range(3):
        step = F[:, (c + 1) % 3] - F[:, (c + 2) % 3]
        imbalance += np.bincount(F[:, c], weights=step, minlength=n)
    on_boundary = imbalance != 0
    chosen = [
        F[on_boundary[F[:, c]] & on_boundary[F[:, (c + 1) % 3]]][:, [c, (c + 1) % 3]]
        for c in range(3)
    ]
    near = np.concatenate(chosen)
    twinned = np.isin(near[:, 0] * n + near[:, 1], near[:, 1] * n + near[:, 0])
    return near[~twinned]


def boundary_loops(F: Indices, n: int) -> list[Indices]:
    """Return the closed curves that bound the surface.

    Each is an array of vertices in order, with the surface on its left, starting at its smallest
    vertex; the loops are sorted by that vertex. A closed surface has none.
    """
    directed = boundary_half_edges(F, n)
    if not len(directed):
        return []
    vertices, local = np.unique(directed, return_inverse=True)
    tail, head = local.reshape(-1, 2).T
    successor = scipy.sparse.csr_array(
        (np.ones(len(tail)), (tail, head)), shape=(len(vertices), len(vertices))
    )
    _, labels = scipy.sparse.csgraph.connected_components(successor, directed=False)
    starts = np.unique(labels, return_index=True)[1]
    return [
        vertices[
            scipy.sparse.csgraph.breadth_first_order(successor, start, return_predecessors=False)
        ]
        for start in np.sort(starts)
    ]
