"""The common refinement of a mesh and of the triangulation that cetm-flips makes of it.

The map of cetm-flips is linear on the flipped triangles, whose edges cross those of the mesh. Cut
along both, the surface consists of convex polygons that have the same corners in the mesh as in the
image, so the map has no folds by construction (Gillespie, Springborn & Crane 2021, Discrete
conformal equivalence of polyhedral surfaces). Every crossing is that of two geodesics in the
hyperbolic metric of the flipped triangulation. Let p, q be the ends of a given edge and a, b those
of a flipped one. In the hyperboloid these are vectors whose products are |ab|^2, and Ptolemy's
relation gives all |pa| along the way, as sums of positive numbers. The geodesics ab and pq meet
where a has the weight |pb| |qb|, b has |pa| |qa|, p has |aq| |bq| and q has |ap| |bp|.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure, moved_to_gauge
from cembench.conformal.last_resort import valid_map
from cembench.core.arrays import Complex, Indices, Real
from cembench.mesh.intrinsic import Triangulation
from cembench.mesh.triangle_mesh import DiskMesh

from .crossings import END, Crossings
from .flips import Uniformised, uniformised
from .triangle_map import disk_of_triangle

#: Where a crossing lies on a given edge and on a flipped one.
Place = tuple[float, float]

#: Least distance of crossings from each other and from the ends, as a share of an edge's length:
#: geodesics that doubles cannot tell apart are spread evenly.
LEAST = 1e-9


@dataclass(frozen=True)
class RefinedMap:
    """A map of a mesh cut along the edges of the flipped triangulation.

    Parameters
    ----------
    mesh : DiskMesh
        The refined surface. Its first vertices are those of the given mesh, all others lie on edges
        of that.
    uv : complex (n',)
        The image of each vertex in the unit disk.
    triangle : int64 (m',)
        The given triangle that each triangle is a part of.
    extras : dict
        What :func:`cembench.algorithms.cetm.flips.cetm_flips` tells; `folded_before_repair` counts
        triangles of the refined mesh.
    """

    mesh: DiskMesh
    uv: Complex
    triangle: Indices
    extras: dict[str, Any]


def refined_map(
    mesh: DiskMesh,
    *,
    tolerance: float = 1e-9,
    max_iterations: int = 200,
    gauge: Gauge = "boundary",
    repair: bool = True,
    last_resort: bool = True,
) -> RefinedMap:
    """Map a disk as cetm-flips does, and return the map on the common refinement.

    From the equilateral triangle, where no refined triangle is folded, an elliptic function takes
    the vertices to the disk. Straight edges between their images are not its image, so thin
    triangles may fold there; these are repaired (:func:`cembench.conformal.last_resort.valid_map`).

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    tolerance, max_iterations, gauge, repair, last_resort
        As for cetm-flips.

    Returns
    -------
    RefinedMap
        The refined surface and its map.

    Raises
    ------
    AlgorithmFailed
        No flat metric was found, or doubles do not hold its layout.

    Examples
    --------
    >>> import cembench
    >>> from cembench.conformal.metrics import flipped_triangles
    >>> disk = cembench.surface("hemi-ellipsoid", 400)
    >>> found = refined_map(disk)
    >>> found.mesh.n >= disk.n, flipped_triangles(found.mesh, found.uv)
    (True, 0)
    """
    watched: list[Triangulation] = []

    def watch(T: Triangulation) -> None:
        watched.append(replace(T, F=T.F.copy(), twin=T.twin.copy(), log_length=T.log_length.copy()))
        T.log = []

    flat = uniformised(mesh, tolerance, max_iterations, watch)
    first, delaunay = watched
    start, paths = (Crossings.none(first.F, first.twin) for _ in range(2))
    paths.flip_all(delaunay.log or [])
    straight = _straight(paths, delaunay)
    paths.flip_all(flat.T.log or [])
    on_given, on_flipped = _places(paths, flat, straight)
    begins = start.first_half_edge
    surface = sorted(x for x in on_given if begins[paths.given[x]] < 3 * mesh.m)
    number = {x: mesh.n + k for k, x in enumerate(surface)}
    V, z = _points(mesh, start, paths, flat, on_given, on_flipped, surface)
    uv = disk_of_triangle(z)
    F, triangle = _cells(mesh, start, paths, number, V, uv)
    fine = DiskMesh.trusted(V, F, name=mesh.name, notices=mesh.notices)
    b = fine.boundary
    measure = np.zeros(fine.n)
    measure[: mesh.n] = gauge_measure(mesh, gauge, mesh.boundary)
    uv[b] /= np.abs(uv[b])
    uv = moved_to_gauge(uv / np.maximum(np.abs(uv), 1.0), measure)
    uv[b] /= np.abs(uv[b])
    with_resort = repair and last_resort
    uv, repaired = valid_map(fine, uv) if with_resort else accepted_repair(fine, uv, repair=repair)
    return RefinedMap(fine, uv, triangle, flat.told | repaired | {"crossings": len(surface)})


def _points(
    mesh: DiskMesh,
    start: Crossings,
    paths: Crossings,
    flat: Uniformised,
    on_given: dict[int, float],
    on_flipped: dict[int, float],
    chosen: Sequence[int],
) -> tuple[Real, Complex]:
    """Return the refined mesh's vertices in space, and in an image of the equilateral triangle."""
    original, flipped = start.first_half_edge, paths.first_half_edge
    h = np.array([original[paths.given[x]] for x in chosen], dtype=np.int64)
    f = np.array([flipped[paths.edge_of[x]] for x in chosen], dtype=np.int64)
    t = np.array([on_given[x] for x in chosen])[:, None]
    s = np.array([on_flipped[x] for x in chosen])
    a, b = mesh.F[h // 3, h % 3], mesh.F[h // 3, (h % 3 + 1) % 3]
    p, q = flat.P[f // 3, f % 3], flat.P[f // 3, (f % 3 + 1) % 3]
    V = np.concatenate([mesh.V, (1 - t) * mesh.V[a] + t * mesh.V[b]])
    return V, np.concatenate([flat.z, (1 - s) * p + s * q])


def _cells(
    mesh: DiskMesh,
    start: Crossings,
    paths: Crossings,
    number: dict[int, int],
    V: Real,
    uv: Complex,
) -> tuple[Indices, Indices]:
    """Return the triangles of the refined mesh, and the given triangle of each."""
    beside: dict[int, tuple[int, int]] = {}  # each crossing's neighbours on its flipped edge
    for there in paths.on_edge:
        for x, before, after in zip(there, [END, *there], [*there[1:], END], strict=False):
            beside[x] = before, after
    cells: list[tuple[int, ...]] = []
    origin: list[int] = []
    for t, corners in enumerate(mesh.F.tolist()):
        around, at = [], dict[int, int]()
        sides: list[tuple[int, int]] = []  # crossings with the number of their side
        for c in range(3):
            around.append(corners[c])
            on_side = paths.path(start.edge[3 * t + c])
            for x in on_side if start.sign[3 * t + c] > 0 else on_side[::-1]:
                at[x] = len(around)
                around.append(number[x])
                sides.append((x, c))
        if not sides:
            cells.append(tuple(corners))
            origin.append(t)
            continue
        place = {v: k for k, v in enumerate(around)}
        chords = set()
        for x, c in sides:
            y = beside[x][(paths.side[x] > 0) == (start.sign[3 * t + c] > 0)]
            end = place[corners[(c + 2) % 3]] if y == END else at[y]
            chords |= {(at[x], end), (end, at[x])}
        for cell in _faces(len(around), chords):
            some = _triangles([around[k] for k in cell], V, uv)
            cells += some
            origin += [t] * len(some)
    return np.array(cells, dtype=np.int64), np.array(origin, dtype=np.int64)


def _faces(count: int, chords: set[tuple[int, int]]) -> list[list[int]]:
    """Return the faces of a convex polygon with so many corners, cut along chords."""
    sides = {(k, (k + 1) % count) for k in range(count)}
    ahead: dict[int, list[int]] = {}
    for a, b in sides | chords:
        ahead.setdefault(a, []).append(b)
    left, faces = sides | chords, []
    while left:
        a, b = left.pop()
        face = [a]
        while b != face[0]:
            face.append(b)
            # The next corner is the last one before a, seen counter-clockwise from b.
            back = (a - b) % count
            after = max(
                (c for c in ahead[b] if (c - b) % count < back), key=lambda c: (c - b) % count
            )
            a, b = b, after
            left.discard((a, b))
        faces.append(face)
    return faces


def _triangles(cell: Sequence[int], V: Real, uv: Complex) -> list[tuple[int, ...]]:
    """Divide a convex cell by a fan from the corner that leaves the least triangle largest."""

    def fan(k: int) -> list[tuple[int, ...]]:
        turned = [*cell[k:], *cell[:k]]
        return [(turned[0], a, b) for a, b in pairwise(turned[1:])]

    def least(k: int) -> float:
        F = np.array(fan(k))
        a, b, c = (V[F[:, j]] for j in range(3))
        x, y, w = (uv[F[:, j]] for j in range(3))
        space = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        plane = np.imag(np.conj(y - x) * (w - x))
        areas = space / (space.sum() or 1), plane / (abs(plane.sum()) or 1)
        return float(min(share.min() for share in areas))

    return fan(0) if len(cell) == 3 else fan(max(range(len(cell)), key=least))


def _straight(paths: Crossings, T: Triangulation) -> dict[int, Place]:
    """Return where straight lines in flat triangles cross their edges, by their crossings."""
    places: dict[int, Place] = {}
    length = np.exp(T.log_length).tolist()
    for path, behind in _behind(paths, T):
        ends = _unfolded(T, length, behind)
        q = ends.pop()[0]
        for x, (a, b) in zip(path, ends, strict=True):
            left, right = (q.conjugate() * a).imag, (q.conjugate() * b).imag
            s = left / (left - right) if left != right else np.nan
            t = ((a + s * (b - a)) / q).real
            places[x] = t, s if paths.side[x] > 0 else 1 - s
    return places


def _behind(paths: Crossings, T: Triangulation) -> Iterator[tuple[list[int], list[int]]]:
    """Give each given edge's crossings, with the half-edges whose triangles lie behind these."""
    along = paths.first_half_edge
    for edge in range(len(paths.first)):
        if path := paths.path(edge):
            ways = [(x, along[paths.edge_of[x]]) for x in path]
            yield path, [h if paths.side[x] > 0 else int(T.twin[h]) for x, h in ways]


def _unfolded(
    T: Triangulation, length: Sequence[float], behind: Sequence[int]
) -> list[tuple[complex, complex]]:
    """Return the ends a, b of the crossed half-edges, unfolded from p = 0; then q twice."""
    h = behind[0]
    t, c = h - h % 3, h % 3
    pa, pb = length[t + (c + 2) % 3], length[t + (c + 1) % 3]
    a: complex = pa + 0j
    b = _tip(0j, a, pb, length[h])
    corners = [(a, b)]
    for before, h in [*pairwise(behind), (behind[-1], -1)]:
        entered = int(T.twin[before])
        t, c = entered - entered % 3, entered % 3
        a, b = corners[-1]
        # The triangle ahead lies on the left of the way from b to a.
        tip = _tip(b, a, length[t + (c + 2) % 3], length[t + (c + 1) % 3])
        if h < 0:
            corners.append((tip, tip))
        elif h == t + (c + 1) % 3:
            corners.append((a, tip))
        else:
            corners.append((tip, b))
    return corners


def _tip(a: complex, b: complex, from_a: float, from_b: float) -> complex:
    """Return the point on the left of the way from a to b at these distances."""
    base = abs(b - a)
    foot = (base * base + (from_a - from_b) * (from_a + from_b)) / (2 * base)
    return a + (b - a) / base * complex(foot, max(from_a * from_a - foot * foot, 0.0) ** 0.5)


def _places(
    paths: Crossings, flat: Uniformised, straight: dict[int, Place]
) -> tuple[dict[int, float], dict[int, float]]:
    """Return where each crossing lies on its given edge and on its flipped one, in (0, 1).

    Crossings with straight lines keep their places, on flipped edges in the projective map that
    scales the vertices. Others have those of geodesics, moved with the former.
    """
    T, u = flat.T, flat.u
    F, log_length = T.F.ravel().tolist(), T.log_length.tolist()
    on_given: dict[int, float] = {}
    on_flipped: dict[int, float] = {}
    scaled: dict[int, float] = {}
    for path, behind in _behind(paths, T):
        from_p = _distances(T, log_length, behind)
        ahead = [int(T.twin[h]) for h in behind[::-1]]
        from_q = [(b, a) for a, b in _distances(T, log_length, ahead)][::-1]
        for x, h, p, q in zip(path, behind, from_p, from_q, strict=True):
            # p and q: log lengths from the ends of the path to the start and the end of h.
            a, b = F[h], F[h - h % 3 + (h % 3 + 1) % 3]
            share = _share(u[a] + p[0] + q[0], u[b] + p[1] + q[1])
            on_given[x] = _share(p[0] + p[1], q[0] + q[1])
            on_flipped[x] = share if paths.side[x] > 0 else 1 - share
            if x in straight:
                s = straight[x][1]
                start, end = (a, b) if paths.side[x] > 0 else (b, a)
                scaled[x] = s / (s + (1 - s) * float(np.exp(np.clip(u[end] - u[start], -700, 700))))
        _put(path, on_given, {x: straight[x][0] for x in path if x in straight})
    for there in paths.on_edge:
        _put(there, on_flipped, {x: scaled[x] for x in there if x in scaled})
    return on_given, on_flipped


def _put(order: Sequence[int], places: dict[int, float], known: dict[int, float]) -> None:
    """Move crossings on an edge so that some have known places, if all stay in order.

    Those that are not apart in order, known or not, are spread evenly.
    """
    if known and _apart(list(known.values())) and _apart([places[x] for x in order]):
        x, y = (np.array([_logit(some[k]) for k in known]) for some in (places, known))
        for k in order:
            at = _logit(places[k])
            nearest = float(np.clip(at, x[0], x[-1]))
            moved = float(np.interp(nearest, x, y)) + at - nearest
            places[k] = known.get(k, _share(moved, 0.0))
    if not _apart([places[x] for x in order]):
        places |= {x: k / (len(order) + 1) for k, x in enumerate(order, 1)}


def _apart(places: Sequence[float]) -> bool:
    """Whether places are in order and distinct in (0, 1)."""
    return bool((np.diff([0.0, *places, 1.0]) > LEAST).all())


def _logit(share: float) -> float:
    """Return the number whose share of it and 0 is this, by :func:`_share`."""
    return float(np.log(share / (1 - share)))


def _distances(
    T: Triangulation, log_length: Sequence[float], behind: Sequence[int]
) -> list[tuple[float, float]]:
    """Return log |pa|, log |pb| for the half-edges ab that a geodesic from a vertex p crosses.

    p is opposite to the first of them, in whose triangles the geodesic lies before each crossing.
    """
    h = behind[0]
    t, c = h - h % 3, h % 3
    lengths = [(log_length[t + (c + 2) % 3], log_length[t + (c + 1) % 3])]
    for before, h in pairwise(behind):
        entered = int(T.twin[before])
        pa, pb = lengths[-1]
        t, c = h - h % 3, h % 3
        following, other = log_length[t + (c + 1) % 3], log_length[t + (c + 2) % 3]
        # Ptolemy: the diagonals from p to the new corner, and ab, of a quadrilateral.
        if entered == t + (c + 2) % 3:  # the new edge runs from a to the new corner
            far = np.logaddexp(following + pa, log_length[h] + pb) - other
            lengths.append((pa, float(far)))
        else:  # from the new corner to b
            far = np.logaddexp(log_length[h] + pa, other + pb) - following
            lengths.append((float(far), pb))
    return lengths


def _share(x: float, y: float) -> float:
    """Return exp(x) / (exp(x) + exp(y))."""
    return float(1 / (1 + np.exp(np.clip(y - x, -700, 700))))
