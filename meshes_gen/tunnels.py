"""Find and plug the tunnels of a surface that should be a disk.

Parts of a solid that nearly touch leave tunnels a few grid cells wide. Each is found as a short
loop that bounds nothing (tree-cotree decomposition, Eppstein 2003) and closed with a small ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.core.arrays import Indices, Real

from .implicit import Field, join
from .local_operations import edges_of


@dataclass(frozen=True)
class Plug:
    """A ball that closes a tunnel."""

    centre: Real
    radius: float

    def add(self, p: Real, d: Real) -> Real:
        """Return the values d of a field at p, joined with the ball."""
        off = p - self.centre
        near = np.abs(off).max(axis=1) < 2.5 * self.radius
        if near.any():
            d = d.copy()
            ball = np.linalg.norm(off[near], axis=1) - self.radius
            d[near] = join(d[near], ball, 0.5 * self.radius)
        return d


def plugged(f: Field, plugs: tuple[Plug, ...]) -> Field:
    """Return the field f joined with the plugs."""
    if not plugs:
        return f

    def g(p: Real) -> Real:
        d = f(p)
        for plug in plugs:
            d = plug.add(p, d)
        return d

    return g


def tunnels(V: Real, F: Indices, root: int | None = None) -> list[Indices]:
    """Return loops that generate the homology that a disk would not have, shortest first.

    They are short as seen from the vertex `root` (default: the highest).
    """
    root = int(np.argmax(V[:, 2])) if root is None else root
    n, m = len(V), len(F)
    edges = edges_of(F, n)
    i, j = edges.ends.T
    length = np.linalg.norm(V[i] - V[j], axis=1) + 1e-12
    graph = scipy.sparse.coo_array((length, (i, j)), shape=(n, n)).tocsr()
    distance, before = scipy.sparse.csgraph.dijkstra(
        graph, directed=False, indices=root, return_predecessors=True
    )
    in_tree = (before[i] == j) | (before[j] == i)
    free = np.flatnonzero(~in_tree)
    # The dual tree takes the edges of long loops, so that short loops remain.
    weight = -(distance[i] + distance[j] + length)
    weight = weight - weight.min() + 1
    outside = np.where(edges.face[:, 1] < 0, m, edges.face[:, 1])
    dual = scipy.sparse.coo_array(
        (weight[free], (edges.face[free, 0], outside[free])), shape=(m + 1, m + 1)
    )
    tree = scipy.sparse.csgraph.minimum_spanning_tree(dual.tocsr()).tocoo()
    taken = np.minimum(tree.row, tree.col) * np.int64(m + 1) + np.maximum(tree.row, tree.col)
    a, b = edges.face[free, 0], outside[free]
    left = free[~np.isin(np.minimum(a, b) * (m + 1) + np.maximum(a, b), taken)]
    loops = [_loop(before, int(i[e]), int(j[e])) for e in left]
    return sorted((loop for loop in loops if len(loop)), key=len)


def _loop(before: NDArray[np.int32], u: int, v: int) -> Indices:
    """Return the edge u v with the tree paths from its ends to where they meet, as vertices."""
    paths = []
    for k in (u, v):
        path = [k]
        while before[path[-1]] >= 0:
            path.append(int(before[path[-1]]))
        paths.append(path)
    return np.array(sorted(set(paths[0]) ^ set(paths[1])), dtype=np.int64)


def plugs_for(V: Real, F: Indices, spacing: float, largest: float) -> tuple[Plug, ...]:
    """Return balls for the tunnels no wider than `largest`, on a surface sampled at `spacing`."""
    loops = tunnels(V, F)
    plugs = _plugs(V, loops, spacing, largest)
    if not plugs and loops:  # seen from closer, a loop may be shorter
        for start in loops[:3]:
            for root in start[:: max(1, len(start) // 5)]:
                plugs = _plugs(V, tunnels(V, F, int(root)), spacing, largest)
                if plugs:
                    return plugs
    return plugs


def _plugs(V: Real, loops: list[Indices], spacing: float, largest: float) -> tuple[Plug, ...]:
    """Return balls that close narrow loops and do not touch each other."""
    plugs: list[Plug] = []
    for loop in loops:
        points = V[loop]
        low, high = points.min(axis=0), points.max(axis=0)
        wide = float(np.linalg.norm(high - low))
        radius = 0.55 * wide + 2.5 * spacing
        centre = (low + high) / 2
        apart = all(np.linalg.norm(centre - p.centre) > radius + p.radius for p in plugs)
        if wide <= largest and apart:
            plugs.append(Plug(centre, radius))
    return tuple(plugs)
