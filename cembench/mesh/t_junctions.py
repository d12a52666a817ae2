"""T-junctions: vertices of one triangle on the side of another, which neither shares.

The side is divided at the vertices, so that both triangles have the same edges. No vertex moves.
"""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np

from cembench.core.arrays import Indices, Points
from cembench.mesh.gluing import edges_of_half_edges
from cembench.mesh.polygons import triangulate

#: A vertex is on a side within this share of its length; files of six digits are accepted.
_ON_SIDE = 1e-5


def split_t_junctions(V: Points, F: Indices) -> tuple[Indices, Indices, int]:
    """Divide boundary sides at the boundary vertices on them, where that makes edges meet.

    Returns
    -------
    F : int64 (m', 3)
        The triangles; those that were divided come last.
    parent : int64 (m',)
        The triangle that each is, or is a part of.
    count : int
        Number of vertices at which sides were divided.
    """
    edges, edge, faces = edges_of_half_edges(F)
    sides = np.flatnonzero(faces[edge] == 1)
    sides = sides[(V[edges[edge[sides], 0]] != V[edges[edge[sides], 1]]).any(axis=1)]
    if not len(sides):
        return F, np.arange(len(F)), 0
    found = _joined(V, *_on_sides(V, F, sides), sides, F)
    everything = np.arange(len(F))
    if not found:
        return F, everything, 0
    divided = np.unique([h // 3 for h in found])
    polygons = []
    for t in divided.tolist():
        polygon: list[int] = []
        for c in range(3):
            polygon += [int(F[t, c]), *found.get(3 * t + c, ())]
        polygons.append(polygon)
    corners, sizes = np.concatenate(polygons), np.array([len(polygon) for polygon in polygons])
    parts = corners[triangulate(V, corners, sizes)]
    whole = np.delete(everything, divided)
    parent = np.concatenate([whole, np.repeat(divided, sizes - 2)])
    return np.concatenate([F[whole], parts]), parent, sum(map(len, found.values()))


def _on_sides(V: Points, F: Indices, sides: Indices) -> tuple[Indices, Indices, Points]:
    """Return half-edges, boundary vertices that are on them, and where: 0 to 1 along each."""
    from scipy.spatial import cKDTree

    t, c = np.divmod(sides, 3)
    a, b = F[t, c], F[t, (c + 1) % 3]
    rim = np.unique([a, b])
    P, along = V[a], V[b] - V[a]
    length = np.linalg.norm(along, axis=1)
    near = cKDTree(V[rim]).query_ball_point(P + along / 2, length / 2, return_sorted=True)
    counts = np.array([len(one) for one in near], dtype=np.int64)
    row = np.repeat(np.arange(len(sides)), counts)
    v = rim[np.concatenate([*near, []]).astype(np.int64)]
    offset, unit = V[v] - P[row], along[row] / length[row, None]
    place = np.einsum("kx,kx->k", offset, unit)
    away = np.linalg.norm(offset - place[:, None] * unit, axis=1)
    slack = _ON_SIDE * length[row]
    good = (away <= slack) & (place > slack) & (length[row] - place > slack)
    good &= (v != a[row]) & (v != b[row]) & (v != F[t, (c + 2) % 3][row])
    return row[good], v[good], place[good]


def _joined(
    V: Points, row: Indices, v: Indices, place: Points, sides: Indices, F: Indices
) -> dict[int, list[int]]:
    """Return the vertices, in order, of each half-edge whose parts are edges of other triangles."""
    order = np.lexsort((place, row))
    on: dict[int, list[int]] = {}
    for k, vertex in zip(row[order].tolist(), v[order].tolist(), strict=True):
        on.setdefault(int(sides[k]), []).append(vertex)
    ends = F.ravel()[sides], np.roll(F, -1, axis=1).ravel()[sides]
    start = dict(
        zip(sides.tolist(), zip(*(end.tolist() for end in ends), strict=True), strict=True)
    )
    while on:
        paths = {h: [start[h][0], *on.get(h, ()), start[h][1]] for h in start}
        parts = Counter(frozenset(part) for path in paths.values() for part in pairwise(path))
        kept = {
            h: [
                v
                for before, v, after in zip(path, path[1:], path[2:], strict=False)
                if parts[frozenset((before, v))] > 1 or parts[frozenset((v, after))] > 1
            ]
            for h, path in paths.items()
            if h in on
        }
        kept = {h: inside for h, inside in kept.items() if inside}
        if kept == on:
            break
        on = kept
    return on
