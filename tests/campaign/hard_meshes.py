"""Surfaces that are hard to map: thin, crowded, pinched, spiky, huge, tiny, and random.

A family is a function from a generator to vertices (n, 3) and triangles (m, 3). A surface need not
be a disk; one that the package refuses with a message is counted as refused.
"""

from __future__ import annotations

from collections.abc import Callable

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Real = NDArray[np.float64]
Faces = NDArray[np.int64]
Arrays = tuple[Real, Faces]
Random = np.random.Generator


def hard_mesh(seed: int, number: int) -> tuple[str, Real, Faces]:
    """Make the surface of this number: its family, vertices and triangles; families take turns."""
    names = list(FAMILIES)
    family = names[number % len(names)]
    rng = np.random.default_rng([seed, number])
    V, F = FAMILIES[family](rng)
    return family, V, F


def _grid(rows: int, columns: int, mask: NDArray[np.bool_] | None = None) -> Arrays:
    """Return the cells of a rectangle that the mask keeps, two triangles each, at whole numbers."""
    i, j = np.indices((rows, columns))
    if mask is not None:
        i, j = i[mask], j[mask]
    a = (i * (columns + 1) + j).ravel()
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    F = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    y, x = np.indices((rows + 1, columns + 1))
    V = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1).astype(float)
    return _compact(V, F)


def _compact(V: Real, F: Faces) -> Arrays:
    used, F = np.unique(F, return_inverse=True)
    return V[used], F.reshape(-1, 3).astype(np.int64)


def _ring(vertices: int) -> Real:
    angle = 2 * np.pi * np.arange(vertices) / vertices
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)


def _rings(k: int, rings: int = 1) -> Faces:
    """Return the triangles of rings of k vertices around vertex 0."""
    F = [[0, 1 + i, 1 + (i + 1) % k] for i in range(k)]
    for a in range(1, (rings - 1) * k, k):
        for i in range(k):
            j, b = (i + 1) % k, a + k
            F += [[a + i, b + i, b + j], [a + i, b + j, a + j]]
    return np.array(F, np.int64)


def _jittered(V: Real, rng: Random, size: float) -> Real:
    return V + size * rng.standard_normal(V.shape)


def _delaunay(points: Real, keep: Callable[[Real], NDArray[np.bool_]]) -> Arrays:
    """Return the Delaunay triangles whose centres are kept: one piece without pinched points."""
    F = Delaunay(points).simplices.astype(np.int64)
    corners = points[F]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    F = np.where((area < 0)[:, None], F[:, ::-1], F)
    F = F[(np.abs(area) > 1e-12) & keep(corners.mean(axis=1))]
    F = _unpinched(F)
    V = np.concatenate([points, np.zeros((len(points), 1))], 1)
    return _compact(V, F)


def _unpinched(F: Faces) -> Faces:
    """Return the largest piece in which no two parts touch in a point alone."""
    while True:
        piece = igl.facet_components(F)[1]
        F = F[piece == np.argmax(np.bincount(piece))]
        edges = {(f[k], f[(k + 1) % 3]) for f in F.tolist() for k in range(3)}
        starts = [a for a, b in edges if (b, a) not in edges]
        pinched = [a for a in set(starts) if starts.count(a) > 1]
        if not pinched:
            return F
        F = F[~np.isin(F, pinched[:1]).any(axis=1)]


def random_disk(rng: Random) -> Arrays:
    """Random points in a random star-shaped outline, with a relief."""
    waves = rng.normal(0, 0.25, 5)

    def radius(angle: Real) -> Real:
        return np.exp(sum(w * np.cos((k + 1) * angle + k) for k, w in enumerate(waves)))

    edge = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(4, 60)))
    rim = radius(edge) * np.exp(1j * edge)
    inner_angle = rng.uniform(0, 2 * np.pi, rng.integers(0, 120))
    inner = radius(inner_angle) * np.sqrt(rng.uniform(0, 0.9, len(inner_angle)))
    z = np.concatenate([rim, inner * np.exp(1j * inner_angle)])
    points = np.stack([z.real, z.imag], 1)

    def inside(p: Real) -> NDArray[np.bool_]:
        w = p[:, 0] + 1j * p[:, 1]
        return np.abs(w) < 1.02 * radius(np.angle(w))

    V, F = _delaunay(points, inside)
    V[:, 2] = rng.uniform(0, 2) * np.sin(3 * V[:, 0]) * np.cos(2 * V[:, 1])
    return V, F


def slivers(rng: Random) -> Arrays:
    """A rectangle whose cells are thousands of times longer than wide."""
    V, F = _grid(int(rng.integers(2, 9)), int(rng.integers(2, 9)))
    V[:, 0] *= 10.0 ** rng.uniform(1, 7)
    return V, F


def needles(rng: Random) -> Arrays:
    """Rows of a rectangle nearly touch each other."""
    V, F = _grid(int(rng.integers(3, 9)), int(rng.integers(3, 9)))
    heights = np.cumsum(10.0 ** rng.uniform(-9, 0, int(V[:, 1].max()) + 1))
    V[:, 1] = heights[V[:, 1].astype(int)]
    return V, F


def ears(rng: Random) -> Arrays:
    """A disk with triangles that hang on it by one edge."""
    V, F = _grid(int(rng.integers(2, 6)), int(rng.integers(2, 6)))
    for edge in _some_boundary_edges(F, rng, int(rng.integers(1, 8))):
        a, b = edge
        out = (V[a] + V[b]) / 2 - V.mean(axis=0)
        tip = (V[a] + V[b]) / 2 + out * 10.0 ** rng.uniform(-3, 1)
        F = np.concatenate([F, [[b, a, len(V)]]])
        V = np.concatenate([V, [tip]])
    return V, F


def _some_boundary_edges(F: Faces, rng: Random, count: int) -> list[tuple[int, int]]:
    directed = {(f[k], f[(k + 1) % 3]) for f in F.tolist() for k in range(3)}
    edges = sorted(e for e in directed if e[::-1] not in directed)
    return [edges[k] for k in rng.permutation(len(edges))[:count]]


def spikes(rng: Random) -> Arrays:
    """A flat disk with vertices pulled far out of it."""
    V, F = _grid(int(rng.integers(3, 10)), int(rng.integers(3, 10)))
    chosen = rng.permutation(len(V))[: int(rng.integers(1, 6))]
    V[chosen, 2] = 10.0 ** rng.uniform(0, 6, len(chosen))
    return V, F


def pinched_boundary(rng: Random) -> Arrays:
    """Two squares with a bridge of one narrow cell."""
    k, length = int(rng.integers(2, 5)), int(rng.integers(1, 12))
    mask = np.zeros((k, 2 * k + length), bool)
    mask[:, :k] = mask[:, -k:] = True
    mask[k // 2, :] = True
    V, F = _grid(*mask.shape, mask)
    between = (V[:, 0] >= k) & (V[:, 0] <= k + length)
    V[between, 1] = k / 2 + (V[between, 1] - k / 2) * 10.0 ** rng.uniform(-6, 0)
    return V, F


def crowded_boundary(rng: Random) -> Arrays:
    """A disk whose boundary vertices gather in a tiny arc."""
    k, rings = int(rng.integers(6, 40)), int(rng.integers(1, 5))
    angle = 2 * np.pi * (np.arange(k) / k) ** rng.uniform(1, 12)
    z = np.concatenate([r * np.exp(1j * angle) for r in (1 + np.arange(rings)) / rings])
    V = np.concatenate([[[0, 0, 0]], np.stack([z.real, z.imag, 0 * z.real], 1)])
    V[:, 2] = rng.uniform(0, 1) * (1 - np.abs(V[:, 0]))
    return V, _rings(k, rings)


def spiral(rng: Random) -> Arrays:
    """A strip, a few triangles wide, rolled up in the plane."""
    length, width = int(rng.integers(20, 120)), int(rng.integers(1, 4))
    V, F = _grid(width, length)
    angle = V[:, 0] * rng.uniform(0.1, 0.5)
    radius = 1 + 0.5 * angle / np.pi + 0.4 * V[:, 1] / width
    V[:, 0], V[:, 1] = radius * np.cos(angle), radius * np.sin(angle)
    return V, F[:, ::-1].copy()


def maze(rng: Random) -> Arrays:
    """The ways of a random maze, one cell wide."""
    n = int(rng.integers(2, 6))
    mask = np.zeros((2 * n - 1, 2 * n - 1), bool)
    seen, way = {(0, 0)}, [(0, 0)]
    mask[0, 0] = True
    while way:
        i, j = way[-1]
        steps = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        free = [s for s in steps if min(s) >= 0 and max(s) < n and s not in seen]
        if not free:
            way.pop()
            continue
        p, q = free[int(rng.integers(len(free)))]
        mask[2 * p, 2 * q] = mask[i + p, j + q] = True
        seen.add((p, q))
        way.append((p, q))
    V, F = _grid(*mask.shape, mask)
    return _jittered(V, rng, 0.05), F


def comb(rng: Random) -> Arrays:
    """A bar with long teeth: deep, narrow bays."""
    teeth, depth = int(rng.integers(2, 10)), int(rng.integers(2, 15))
    mask = np.zeros((depth + 1, 2 * teeth - 1), bool)
    mask[0, :] = True
    mask[:, ::2] = True
    V, F = _grid(*mask.shape, mask)
    V[:, 1] *= 10.0 ** rng.uniform(-1, 2)
    return V, F


def few_triangles(rng: Random) -> Arrays:
    """One to six triangles in a fan, a strip or round a vertex."""
    count = int(rng.integers(1, 7))
    if rng.random() < 0.5:
        V = rng.standard_normal((count + 2, 3))
        F = np.array([[0, k + 1, k + 2] for k in range(count)])
    else:
        k = count + 2
        V = np.concatenate([[[0, 0, rng.normal()]], _ring(k)])
        F = _rings(k)
    return V, F.astype(np.int64)


def huge_or_tiny(rng: Random) -> Arrays:
    """A random disk in units in which its coordinates, or their squares, are extreme."""
    V, F = random_disk(rng)
    return V * 10.0 ** rng.choice([-300, -200, -160, -100, -30, 30, 100, 153, 160, 200, 300]), F


def far_away(rng: Random) -> Arrays:
    """A small disk so far from the origin that digits are lost."""
    V, F = random_disk(rng)
    return V + 10.0 ** rng.uniform(3, 15), F


def duplicated_positions(rng: Random) -> Arrays:
    """Vertices at the same place, or nearly, without sharing a triangle's area."""
    V, F = random_disk(rng)
    pairs = rng.integers(0, len(V), (int(rng.integers(1, 5)), 2))
    for i, j in pairs:
        V[i] = V[j] + rng.choice([0.0, 1e-300, 1e-15, 1e-9])
    return V, F


def flat_triangles(rng: Random) -> Arrays:
    """Triangles whose corners are nearly on a line."""
    V, F = _grid(int(rng.integers(2, 7)), int(rng.integers(2, 7)))
    face = F[int(rng.integers(len(F)))]
    V[face[2]] = (V[face[0]] + V[face[1]]) / 2
    V[face[2], 2] += 10.0 ** rng.uniform(-15, -1)
    return V, F


def close_holes(rng: Random) -> Arrays:
    """Holes a cell away from each other and from the rim."""
    mask = np.ones((int(rng.integers(5, 12)), int(rng.integers(5, 12))), bool)
    i = 1
    while i < mask.shape[0] - 1:
        j = 1
        while j < mask.shape[1] - 1:
            wide = int(rng.integers(1, 4))
            mask[i, j : min(j + wide, mask.shape[1] - 1)] = rng.random() > 0.6
            j += wide + 1
        i += 2
    V, F = _grid(*mask.shape, mask)
    return _jittered(V, rng, 0.08), F


def round_holes(rng: Random) -> Arrays:
    """A disk with round holes, near each other or near the rim."""
    count = int(rng.integers(1, 5))
    circles = [(0j, 1.0)]
    for _ in range(200):
        c = rng.uniform(0, 0.9) * np.exp(2j * np.pi * rng.random())
        r = 10.0 ** rng.uniform(-1.5, -0.4)
        gaps = [1 - abs(c) - r] + [abs(c - d) - r - s for d, s in circles[1:]]
        if min(gaps) > 0.01 and len(circles) <= count:
            circles.append((complex(c), r))
    rims = [
        c + r * np.exp(2j * np.pi * np.arange(k) / k)
        for c, r in circles
        for k in [max(6, int(30 * r) + int(rng.integers(0, 20)))]
    ]
    inner = np.sqrt(rng.random(120)) * np.exp(2j * np.pi * rng.random(120))
    z = np.concatenate([*rims, [w for w in inner if _clear(w, circles)]])

    def inside(p: Real) -> NDArray[np.bool_]:
        w = p[:, 0] + 1j * p[:, 1]
        return np.all([np.abs(w - c) > 0.9 * r for c, r in circles[1:]], axis=0) & (np.abs(w) < 1)

    V, F = _delaunay(np.stack([z.real, z.imag], 1), inside)
    V[:, 2] = rng.uniform(0, 1) * np.cos(2 * V[:, 0])
    return V, F


def _clear(w: complex, circles: list[tuple[complex, float]]) -> bool:
    return abs(w) < 0.98 and all(abs(w - c) > 1.02 * r for c, r in circles[1:])


def high_valence(rng: Random) -> Arrays:
    """A vertex with hundreds of neighbours."""
    k = int(rng.integers(50, 400))
    V = np.concatenate([[[0, 0, rng.uniform(0, 20)]], _ring(k)])
    V[1:] *= rng.uniform(0.5, 2, (k, 1))
    return V, _rings(k)


def noise(rng: Random) -> Arrays:
    """A rectangle crumpled by noise as large as its cells."""
    V, F = _grid(int(rng.integers(3, 14)), int(rng.integers(3, 14)))
    return _jittered(V, rng, 10.0 ** rng.uniform(-1, 1)), F


def crumpled_holes(rng: Random) -> Arrays:
    """A surface with holes, crumpled by noise."""
    V, F = close_holes(rng)
    return _jittered(V, rng, 10.0 ** rng.uniform(-1, 0.5)), F


def deep_bowl(rng: Random) -> Arrays:
    """A sphere but for a small opening: nearly everything is far from the boundary."""
    k, rings = int(rng.integers(5, 20)), int(rng.integers(4, 14))
    opening = 10.0 ** rng.uniform(-4, 0)
    polar = np.linspace(np.pi / rings, np.pi - opening, rings)
    angle = 2 * np.pi * np.arange(k) / k
    V = [[0.0, 0.0, 1.0]] + [
        [np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)] for p in polar for a in angle
    ]
    return np.array(V), _rings(k, rings)


FAMILIES: dict[str, Callable[[Random], Arrays]] = {
    family.__name__.replace("_", " "): family
    for family in (
        *(random_disk, slivers, needles, ears, spikes, pinched_boundary, crowded_boundary),
        *(spiral, maze, comb, few_triangles, huge_or_tiny, far_away, duplicated_positions),
        *(flat_triangles, close_holes, round_holes, high_valence, noise, crumpled_holes),
        *(deep_bowl,),
    )
}
