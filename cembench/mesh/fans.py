"""The fans of triangles around vertices.

The triangles at a vertex form one or more fans: each is glued along the edges at the vertex, and is
a cycle, or a sequence between two boundary edges. A vertex of a manifold has exactly one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.gluing import twins_of_half_edges

Indices = NDArray[np.int64]


def vertices_of_several_fans(F: Indices, n: int) -> Indices:
    """Return the vertices whose triangles form more than one fan, ascending.

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
