"""Coincident and nearly coincident vertices: which to weld, and at which distance.

A file has several vertices at one position where its format needs them (one per texture coordinate
or normal, one per node of a regular grid), and where somebody cut the surface open. The first kind
is welded, the second kept. :func:`are_copies` tells them apart by the numbering and by the poles.
"""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices, Points, marked
from cembench.mesh.defects import LARGEST_LENGTH, representatives
from cembench.mesh.gluing import edges_of_half_edges
from cembench.mesh.topology import boundary_loops, first_of_linked

#: Boundary vertices closer than this share of the largest coordinate coincide up to rounding:
#: sin(2 pi) is not 0.
_ROUNDING = 2e-15
#: At the pole of a grid at least so many vertices have one position.
_POLE = 3
#: Gaps between boundary vertices are below this share of the edges there.
_GAP = 0.1


def boundary_vertices(F: Indices) -> Indices:
    """Return the vertices of edges with a single triangle, ascending."""
    edges, _, faces = edges_of_half_edges(F)
    return np.unique(edges[faces == 1])


def coincident_vertices(V: Points, F: Indices) -> Indices:
    """Return the first vertex at the position of each, (n,); on the boundary up to rounding."""
    first = representatives(V)
    rim = boundary_vertices(F)
    largest = float(np.abs(V[rim]).max(initial=0.0))
    if not 0 < largest <= LARGEST_LENGTH:
        return first
    near = rim[representatives(V[rim], _ROUNDING * largest)]
    if (near == first[rim]).all():
        return first
    every = np.arange(len(V))
    return first_of_linked(np.r_[every, rim], np.r_[first, near], len(V))


def are_copies(F: Indices, first: Indices) -> bool:
    """Whether coincident vertices are copies that a format or a grid needs, and not a cut.

    Parameters
    ----------
    F : int64 (m, 3)
        Triangles of a surface that is a manifold as it is.
    first : int64 (n,)
        The first vertex at the position of each.

    Returns
    -------
    bool
        True where many vertices at one position or at two are joined by edges or have one triangle
        each, as at the poles of a grid; where all boundaries are slits, more than one, of a surface
        that is closed otherwise, as decimation leaves them; where copies follow their originals at
        few regular distances, as on the sides of a grid; and where the last vertices are copies of
        the first, as of its first row. A cut adds its copies at the end, in the order of its curve.
    """
    at, counts = first[F], np.bincount(first)
    joined = marked(len(counts), at[at == np.roll(at, 1, axis=1)])
    lone = np.bincount(first, np.bincount(F.ravel(), minlength=len(first)) == 1) == counts
    if 1 <= np.count_nonzero((joined | lone) & (counts >= _POLE)) <= 2:
        return True
    if not len(boundary_vertices(at)) and len(boundary_loops(F, len(first))) > 1:
        return True
    copies = np.flatnonzero(first != np.arange(len(first)))
    if copies[-1] - copies[0] == len(copies) - 1 and copies[-1] == len(first) - 1:
        return len(copies) >= 3 and (first[copies] == np.arange(len(copies))).all()
    steps = len(np.unique(copies - first[copies]))
    return steps <= 3 and len(copies) >= max(3, 2 * steps)


def shortest_at_vertices(n: int, edges: Indices, lengths: Points) -> Points:
    """Return the length of the shortest edge at each vertex that is not 0; infinite for none."""
    shortest = np.full(n, np.inf)
    for k in (0, 1):
        np.minimum.at(shortest, edges[:, k], np.where(lengths > 0, lengths, np.inf))
    return shortest


def tolerances_of_gaps(V: Points, F: Indices, most: int = 4) -> list[float]:
    """Return powers of ten that may close the gaps between boundary vertices, the smallest first.

    A gap is the distance to the next boundary vertex that shares no edge, where that is far below
    the edges at the vertex. Empty where there is no gap.
    """
    from scipy.spatial import cKDTree

    edges, _, faces = edges_of_half_edges(F)
    vertices = np.unique(edges[faces == 1])
    if len(vertices) < 2:
        return []
    lengths = np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1)
    shortest = shortest_at_vertices(len(V), edges, lengths)[vertices]
    away, _ = cKDTree(V[vertices]).query(V[vertices], k=2)
    gaps = away[:, 1]
    near = np.isfinite(gaps) & (gaps > 0) & (gaps < _GAP * shortest)
    if not near.any():
        return []
    low, high = gaps[near].min(), min(2 * gaps[near].max(), _GAP * shortest[near].max())
    powers = 10.0 ** np.arange(np.ceil(np.log10(low)), np.ceil(np.log10(high)) + 2)
    return [float(f"{power:.0e}") for power in powers if power < _GAP * np.median(shortest)][:most]
