"""Cut a surface open along short curves until it is a disk.

The curves form a *cut graph*: removing it from the surface leaves one disk. An initial cut graph
comes from a tree-cotree decomposition [1]_: a tree of shortest paths from a root, and a spanning
tree of the triangles that crosses the edges farthest from the root. The edges in neither tree, with
their paths to the root, cut every handle; the tree joins holes to them. Then each arc of the graph
is replaced by the shortest one that serves the same purpose, until none becomes shorter. That arc
is a shortest path between the two boundaries of the annulus that remains if only this arc is glued.

A sphere is simply connected without a cut, but needs a boundary to be mapped to the disk. It is cut
along a shortest path between two distant points.

References
----------
.. [1] J. Erickson, K. Whittlesey, "Greedy optimal homotopy and homology generators", SODA 2005.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy

from cembench.core.arrays import Complex, Indices, Mask, Points, marked
from cembench.core.atomic import write_bytes
from cembench.core.errors import MeshError, ParameterError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology
from cembench.mesh.defects import UnusableMeshError, components
from cembench.mesh.gluing import edges_of_half_edges, glue, paired_half_edges
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Edge = tuple[int, int]

#: An arc is replaced if that shortens it by more than this share.
_SHORTER = 1e-9
#: Rounds over all arcs; few surfaces need more than three.
_ROUNDS = 10
#: Number of roots tried for the tree, far from each other.
_ROOTS = 4


@dataclass(frozen=True)
class Cut:
    """A surface cut open, into a disk unless given seams divide it."""

    #: The disk, or several pieces. Its triangles are those of the surface, in the same order.
    mesh: TriangleMesh
    #: The vertex of the surface that each vertex of the disk is a copy of. The first n vertices of
    #: the disk are the n vertices of the surface.
    origin: Indices
    #: The edges (k, 2) of the surface that were cut, and their total length.
    edges: Indices
    length: float


@dataclass(frozen=True)
class DiskCut(Cut):
    """A surface cut open into a disk."""

    mesh: DiskMesh


def cut_open(mesh: TriangleMesh, through: Sequence[int] = ()) -> DiskCut:
    """Cut a surface into a disk along short curves.

    Parameters
    ----------
    mesh : TriangleMesh
        A connected surface, closed or with boundary loops, of any genus.
    through : sequence of int
        Vertices that the cut has to pass, counted from 0. Without any, a sphere is cut between two
        distant points.

    Returns
    -------
    Cut
        The disk, and how its vertices correspond to the surface's.

    Raises
    ------
    UnusableMeshError
        The surface is not connected.
    ParameterError
        A vertex is not in the mesh, or two neighbours are the only vertices given on a sphere.
    """
    pieces = components(mesh.F, mesh.n)
    if pieces is not None:
        raise UnusableMeshError([pieces])
    named = np.atleast_1d(np.asarray(through, dtype=object)).tolist()
    for vertex in named:
        if not (isinstance(vertex, int | np.integer) and 0 <= vertex < mesh.n):
            raise ParameterError(
                f"there is no vertex {vertex} in {mesh.name}; allowed are whole numbers from 0 to "
                f"{mesh.n - 1}."
            )
    net = _Net.of(mesh)
    points = list(dict.fromkeys(named))
    if net.is_sphere and len(points) < 2:
        points = net.far_points(points, 2)
    marks = frozenset(points)
    graph = min((net.cut_graph(root, marks) for root in net.roots(points)), key=net.length)
    graph = _without_ears(net, _shortened(net, graph, marks), marks)
    if net.is_sphere and len(graph) < 2:
        a, b = points[:2]
        raise ParameterError(
            f"vertices {a} and {b} are neighbours; a cut of one edge leaves the surface closed. "
            "Name two vertices that lie farther apart."
        )
    F, origin = net.cut(graph)
    copies = np.arange(mesh.n, len(origin))
    if (origin[copies] == np.arange(len(copies))).all():
        # In this order they could be the last row of a closed grid, which a repair welds.
        number = np.concatenate([np.arange(mesh.n), copies[::-1]])
        F, origin = number[F], origin[number]
    message = f"cut open along {len(graph):,} edges of length {net.length(graph):.6g}"
    notices = mesh.notices + ((Notice(NoticeKind.CUT_OPEN, message),) if graph else ())
    disk = DiskMesh.from_arrays(mesh.V[origin], F, name=mesh.name, notices=notices)
    edges = net.edges[np.array(sorted(graph), dtype=np.int64)]
    return DiskCut(disk, origin, edges, net.length(graph))


def cut_along(mesh: TriangleMesh, edges: Indices) -> Cut:
    """Cut a surface along given edges (k, 2), and further where one piece is not a disk then.

    Edges that divide the surface make several pieces, which are not cut further.

    Raises
    ------
    ParameterError
        Two vertices are not joined by an edge.
    UnusableMeshError
        The surface is not connected.
    """
    pieces = components(mesh.F, mesh.n)
    if pieces is not None:
        raise UnusableMeshError([pieces])
    net = _Net.of(mesh)
    low, high = np.sort(np.asarray(edges, dtype=np.int64).reshape(-1, 2), axis=1).T
    number = np.minimum(net._between(low, high), len(net.edges) - 1)
    missing = np.flatnonzero((net.edges[number] != np.stack([low, high], axis=1)).any(axis=1))
    if len(missing):
        i, j = low[missing[0]], high[missing[0]]
        raise ParameterError(f"no edge of {mesh.name} joins the vertices {i} and {j}.")
    graph = sorted({k for k in number.tolist() if not net.rim[k]})
    F, origin = net.cut(graph)
    opened = TriangleMesh.from_arrays(mesh.V[origin], F, name=mesh.name, notices=mesh.notices)
    islands = topology.components(F, opened.n)[0]
    chosen, length = net.edges[graph], net.length(graph)
    said = f"cut open along {len(graph):,} given edges of length {length:.6g}"
    if islands > 1:
        said += f", into {islands} islands"
    else:
        rest = cut_open(opened)
        if len(rest.edges):
            said += f", and {len(rest.edges):,} more that a disk needs"
        chosen = np.concatenate([chosen, origin[rest.edges]])
        opened, origin, length = rest.mesh, origin[rest.origin], length + rest.length
    kept = tuple(one for one in opened.notices if one.kind is not NoticeKind.CUT_OPEN)
    notices = (*kept, Notice(NoticeKind.CUT_OPEN, said))
    whole = opened.trusted(opened.V, opened.F, opened.name, notices)
    return Cut(whole, origin, chosen, length)


def edges_of_paths(mesh: TriangleMesh, paths: Iterable[Sequence[int]]) -> Indices:
    """Return the edges (k, 2) of paths through these vertices, the shortest between two of them.

    Raises
    ------
    ParameterError
        A vertex is not in the mesh, or a path has fewer than two.
    """
    net = _Net.of(mesh)
    graph = net._distances()
    edges: list[Edge] = []
    for path in paths:
        named = [int(vertex) for vertex in path]
        wrong = [vertex for vertex in named if not 0 <= vertex < mesh.n]
        if wrong or len(named) < 2:
            raise ParameterError(
                f"a seam goes through {named}; allowed are two or more vertices of {mesh.name}, "
                f"whole numbers from 0 to {mesh.n - 1}."
            )
        for start, end in pairwise(named):
            _, before = scipy.sparse.csgraph.dijkstra(
                graph, indices=start, return_predecessors=True
            )
            while end != start:
                edges.append((int(before[end]), end))
                end = int(before[end])
    return np.array(edges, dtype=np.int64).reshape(-1, 2)


def read_seams(path: Path) -> list[list[int]]:
    """Read a text file with the vertices of a seam on each line, between spaces or commas.

    Raises
    ------
    ParameterError
        The file cannot be read, or a line holds anything else.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        rows = [line.partition("#")[0].replace(",", " ").split() for line in lines]
        return [[int(word) for word in row] for row in rows if row]
    except (OSError, ValueError):
        raise ParameterError(
            f"{path} cannot be read as seams; allowed is a text file with the vertices of a seam "
            "on each line, whole numbers counted from 0."
        ) from None


def edges_of_uv_seams(mesh: TriangleMesh, uv: Complex) -> Indices:
    """Return the edges (k, 2) at which texture coordinates of the corners (m, 3) differ."""
    net = _Net.of(mesh)
    (s, c), (t, d) = (np.divmod(half_edges, 3) for half_edges in net.pairs.T)
    ends = uv[s, c] - uv[t, (d + 1) % 3], uv[s, (c + 1) % 3] - uv[t, d]
    slack = 1e-6 * float(np.abs(uv - uv.mean()).max())
    apart = np.maximum(*map(np.abs, ends)) > slack
    return net.edges[net.edge[net.pairs[apart, 0]]]


def write_numbers(path: Path, what: str, original: Indices) -> None:
    """Write a CSV file with the original of each vertex or triangle, counted from 0."""
    rows = "".join(f"{k},{v}\n" for k, v in enumerate(original.tolist()))
    content = f"{what},original\n{rows}".encode()
    write_bytes(path, content, error=MeshError, parents=False)


@dataclass(frozen=True)
class _Net:
    """The edges of a surface; a cut graph is a set of indices of interior edges."""

    V: Points
    F: Indices
    edges: Indices  #: (e, 2), smaller vertex first, ascending
    edge: Indices  #: (3m,), the edge of each half-edge
    pairs: Indices  #: (interior edges, 2), their half-edges
    lengths: Points  #: (e,)
    rim: Mask  #: (e,), whether an edge is on the boundary
    loops: tuple[Indices, ...]

    @classmethod
    def of(cls, mesh: TriangleMesh) -> _Net:
        edges, edge, faces = edges_of_half_edges(mesh.F)
        lengths = np.linalg.norm(mesh.V[edges[:, 0]] - mesh.V[edges[:, 1]], axis=1)
        pairs = paired_half_edges(edge, faces)
        return cls(mesh.V, mesh.F, edges, edge, pairs, lengths, faces == 1, mesh.loops)

    @property
    def n(self) -> int:
        return len(self.V)

    @property
    def is_sphere(self) -> bool:
        return not self.loops and self.n - len(self.edges) + len(self.F) == 2

    def length(self, graph: Iterable[int]) -> float:
        return float(self.lengths[list(graph)].sum())

    def numbers(self, path: Indices) -> list[int]:
        """Return the edges between successive vertices of a path."""
        return self._between(path[:-1], path[1:]).tolist()

    def roots(self, points: list[int]) -> list[int]:
        """Return the vertices at which trees of shortest paths may start."""
        if points:
            return points[:1]
        if self.loops:
            return [int(loop[0]) for loop in self.loops[:_ROOTS]]
        return self.far_points([], _ROOTS)

    def far_points(self, points: list[int], count: int) -> list[int]:
        """Add vertices, each as far as possible from the previous ones."""
        graph = self._distances()
        if not points:
            points = [int(np.argmax(scipy.sparse.csgraph.dijkstra(graph, indices=0)))]
        while len(points) < count:
            away = scipy.sparse.csgraph.dijkstra(graph, indices=points, min_only=True)
            points = [*points, int(np.argmax(away))]
        return points

    def cut_graph(self, root: int, marks: frozenset[int]) -> frozenset[int]:
        """Return a tree-cotree cut graph that reaches these vertices."""
        away, before = scipy.sparse.csgraph.dijkstra(
            self._distances(), indices=root, return_predecessors=True
        )
        child = np.flatnonzero(before >= 0)
        in_tree = marked(len(self.edges), self._between(child, before[child]))
        crossed = self._cotree(away, in_tree)
        loose = np.flatnonzero(~(in_tree | crossed | self.rim))
        ends = [int(loop[np.argmin(away[loop])]) for loop in self.loops]
        graph = set(loose.tolist())
        for vertex in (*self.edges[loose].ravel().tolist(), *ends, *marks):
            while vertex != root:
                following = int(before[vertex])
                step = int(self._between(np.array([vertex]), np.array([following]))[0])
                if step in graph:
                    break
                if not self.rim[step]:
                    graph.add(step)
                vertex = following
        return _pruned(self, graph, marks)

    def cut(self, graph: Iterable[int]) -> tuple[Indices, Indices]:
        """Return the triangles cut along these edges, and the original of each vertex."""
        open_ = marked(len(self.edges), list(graph))
        return glue(self.F, self.pairs[~open_[self.edge[self.pairs[:, 0]]]], self.n)

    def _between(self, i: Indices, j: Indices) -> Indices:
        keys = self.edges[:, 0] * self.n + self.edges[:, 1]
        return np.searchsorted(keys, np.minimum(i, j) * self.n + np.maximum(i, j))

    def _distances(self) -> scipy.sparse.csr_array:
        """Return the weighted edge graph; boundary edges cost almost nothing, as they are open."""
        weights = np.where(self.rim, 1e-9 * self.lengths.mean(), self.lengths)
        return _graph(self.edges, weights, self.n)

    def _cotree(self, away: Points, in_tree: Mask) -> Mask:
        """Return the edges that a spanning tree of the triangles crosses, farthest first."""
        number = self.edge[self.pairs[:, 0]]
        loop_length = away[self.edges[number]].sum(axis=1) + self.lengths[number]
        most = loop_length.max() + self.lengths.mean()
        cost = np.where(in_tree[number], 2 * most, most - loop_length)
        m = len(self.F)
        i, j = np.sort(self.pairs // 3, axis=1).T
        tree = scipy.sparse.csgraph.minimum_spanning_tree(
            scipy.sparse.coo_array((cost, (i, j)), shape=(m, m))
        )
        chosen = tree.tocoo()
        keys = i * m + j
        order = np.argsort(keys)
        at = np.searchsorted(keys[order], chosen.row.astype(np.int64) * m + chosen.col)
        return marked(len(self.edges), number[order[at]])


def _graph(edges: Indices, weights: Points, n: int) -> scipy.sparse.csr_array:
    """Return the symmetric weighted graph of edges (k, 2) on n vertices."""
    i, j = edges.T
    both = np.concatenate([weights, weights])
    ends = (np.concatenate([i, j]), np.concatenate([j, i]))
    return scipy.sparse.coo_array((both, ends), shape=(n, n)).tocsr()


def _neighbours(net: _Net, graph: Iterable[int]) -> dict[int, list[Edge]]:
    """Return the edges of a cut graph at each of its vertices, as (edge, other end)."""
    around: dict[int, list[Edge]] = defaultdict(list)
    for number in sorted(graph):
        i, j = net.edges[number].tolist()
        around[i].append((number, j))
        around[j].append((number, i))
    return around


def _held(net: _Net, marks: frozenset[int]) -> frozenset[int]:
    """Return the vertices at which a cut may end: on the boundary, and those it has to reach."""
    return marks.union(*(loop.tolist() for loop in net.loops))


def _pruned(net: _Net, graph: Iterable[int], marks: frozenset[int]) -> frozenset[int]:
    """Remove the branches that end in the interior of the surface."""
    left = set(graph)
    around = _neighbours(net, left)
    held = _held(net, marks)
    ends = [v for v, there in around.items() if len(there) == 1 and v not in held]
    while ends:
        vertex = ends.pop()
        ((number, other),) = around.pop(vertex)
        left.discard(number)
        around[other].remove((number, vertex))
        if len(around[other]) == 1 and other not in held:
            ends.append(other)
    return frozenset(left)


def _arcs(net: _Net, graph: frozenset[int], marks: frozenset[int]) -> list[list[int]]:
    """Return the arcs between branch points, ends and the boundary, longest first."""
    around = _neighbours(net, graph)
    held = _held(net, marks)
    nodes = [v for v, there in around.items() if len(there) != 2 or v in held]
    arcs, seen = [], set()
    for node in nodes:
        for number, other in around[node]:
            if number in seen:
                continue
            arc, before, vertex = [number], number, other
            while len(around[vertex]) == 2 and vertex not in held:
                before, vertex = next(e for e in around[vertex] if e[0] != before)
                arc.append(before)
            seen.update(arc)
            arcs.append(sorted(arc))
    return sorted(arcs, key=net.length, reverse=True)


def _shortened(net: _Net, graph: frozenset[int], marks: frozenset[int]) -> frozenset[int]:
    """Replace arcs by shorter ones until no single arc can be shortened."""
    for _ in range(_ROUNDS):
        before = net.length(graph)
        for arc in _arcs(net, graph, marks):
            if arc not in _arcs(net, graph, marks):  # another replacement now ends on it
                continue
            rest = graph.difference(arc)
            shorter = _pruned(net, rest.union(_shortest_arc(net, rest, arc, marks)), marks)
            if net.length(shorter) < (1 - _SHORTER) * net.length(graph):
                graph = shorter
        if net.length(graph) >= (1 - _SHORTER) * before:
            break
    return graph


def _shortest_arc(
    net: _Net,
    rest: frozenset[int],
    arc: list[int],
    marks: frozenset[int],
    *,
    spare_rim: bool = False,
) -> list[int]:
    """Return the shortest arc that turns the surface, cut along the rest of the graph, into a disk.

    It joins the two boundaries of an annulus; or it joins an end that must be reached to the
    boundary of a disk, or to the other end on a sphere. With `spare_rim` it avoids triangles that
    have a side on the boundary, if another path exists.
    """
    F, origin = net.cut(rest)
    edges, edge, faces = edges_of_half_edges(F)
    n = len(origin)
    ends = net.edges[arc].ravel()
    loops = topology.boundary_loops(F, n)
    touched = np.unique(origin[np.concatenate(loops)]) if loops else np.empty(0, dtype=np.int64)
    tips = [int(v) for v in marks.intersection(ends.tolist()) if v not in touched]
    if len(loops) == 2:
        sources, targets = loops
    elif len(tips) == 1 and len(loops) == 1:
        sources, targets = np.array(tips), loops[0]
    elif len(tips) == 2 and not loops:
        sources, targets = np.array(tips[:1]), np.array(tips[1:])
    else:  # the arc joins marked points in another way: keep it
        return arc
    points = net.V[origin]
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    if spare_rim:
        sides = edge.reshape(-1, 3)
        beside = np.unique(sides[(faces[sides] == 1).any(axis=1)])
        lengths[beside] += lengths.sum()  # longer than any other path
    away, before, source = scipy.sparse.csgraph.dijkstra(
        _graph(edges, lengths, n), indices=sources, min_only=True, return_predecessors=True
    )
    reached = away[targets]
    if spare_rim:  # where four arcs meet, some have little room
        reached = reached + (origin[source[targets]] == origin[targets]) * lengths.sum()
    path = [int(targets[np.argmin(reached)])]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return net.numbers(origin[path])


def _without_ears(net: _Net, graph: frozenset[int], marks: frozenset[int]) -> frozenset[int]:
    """Reroute arcs whose cut would leave triangles attached by one side only.

    The tip of such a triangle has no interior neighbour, and a map may have to fold it. These
    triangles appear where arcs meet at a small angle.
    """
    sides = net.edge.reshape(-1, 3)

    def ears(graph: frozenset[int]) -> Indices:
        taken, open_ = np.zeros((2, len(net.edges)), dtype=bool)
        taken[list(graph)] = True
        open_ = taken | net.rim
        hanging = (open_[sides].sum(axis=1) >= 2) & taken[sides].any(axis=1)
        return np.flatnonzero(hanging)

    best = graph
    for _ in range(_ROUNDS):
        for arc in _arcs(net, graph, marks):
            hanging = ears(graph)
            if not len(hanging):
                return graph
            if arc not in _arcs(net, graph, marks) or not np.isin(arc, sides[hanging]).any():
                continue
            rest = graph.difference(arc)
            rerouted = _shortest_arc(net, rest, arc, marks, spare_rim=True)
            moved = _pruned(net, rest.union(rerouted), marks)
            if len(ears(moved)) <= len(hanging):  # moving one arc may make room for the next
                graph = moved
        best = min(best, graph, key=lambda one: (len(ears(one)), net.length(one)))
    return best
