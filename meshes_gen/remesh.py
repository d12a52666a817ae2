"""From an implicit solid to a disk with given counts.

Marching cubes, a clean cut along ``keep = 0``, isotropic remeshing (pymeshlab's filter, or local
operations alone if the filter is missing); then the boundary is resampled to its count and the
triangles to theirs, with all vertices kept on the surface by Newton steps, and Delaunay flips.
Large counts are reached by subdividing a mesh of at most :data:`BASE` triangles, projected back to
the surface each time, so that fine detail of the solid appears once the mesh can represent it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
import scipy

from cembench.core.arrays import Indices, Real
from cembench.core.errors import MeshError
from cembench.core.extras import Extra, missing, require
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology
from cembench.mesh.triangle_mesh import TriangleMesh

from .implicit import Body, Field, evaluate, gradient, to_curve, to_surface
from .local_operations import (
    area_vectors,
    boundary_mask,
    collapse,
    compact,
    delaunay_flips,
    edges_of,
    flip,
    mean_of_neighbours,
    on_grid,
    quads_of,
    split,
    subdivide,
    vertex_normals,
)
from .tunnels import plugged, plugs_for

M = TypeVar("M", bound=TriangleMesh)

#: Largest count that is remeshed directly; above it, meshes are subdivided.
BASE = 110_000

#: Every how manyth triangle of a first mesh, all oriented alike, is tested for facing outwards.
ORIENTED_BY = 16

#: The notice for a missing pymeshlab filter.
FALLBACK_NOTE = Notice(
    NoticeKind.REMESHED_WITHOUT_FILTER,
    "remeshed by local operations alone: pymeshlab's isotropic remeshing filter is missing "
    "(see `cembench doctor`)",
)


@lru_cache(maxsize=1)
def has_remeshing_filter() -> bool:
    """Whether pymeshlab can remesh; its plug-ins vanish silently without libOpenGL."""
    if missing(Extra.STANDINS, "pymeshlab"):
        return False
    try:
        import pymeshlab
    except ImportError:  # a system library is missing
        return False
    return hasattr(pymeshlab.MeshSet, "meshing_isotropic_explicit_remeshing") or hasattr(
        pymeshlab.MeshSet(), "meshing_isotropic_explicit_remeshing"
    )


# ---- a first mesh ---------------------------------------------------------------------------


def sample(body: Body) -> tuple[Real, Real, float]:
    """Return a field on a grid: values, lower corner, spacing.

    Away from the surface, where only the sign matters, values come from a grid four times coarser.
    """
    lower, extent = np.array(body.lower), np.subtract(body.upper, body.lower)
    spacing = body.size / body.cells
    coarse_shape = np.ceil(extent / (4 * spacing)).astype(int) + 1
    axes = [lower[d] + 4 * spacing * np.arange(coarse_shape[d]) for d in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    coarse = evaluate(body.f, points).reshape(tuple(coarse_shape))
    values = coarse
    for axis in range(3):
        count = coarse_shape[axis]
        at = np.arange(4 * (count - 1) + 1) / 4
        low = np.minimum(at.astype(int), count - 2)
        shape = [1, 1, 1]
        shape[axis] = len(at)
        t = (at - low).reshape(shape)
        values = np.take(values, low, axis) * (1 - t) + np.take(values, low + 1, axis) * t
    near = np.abs(values) < 10 * spacing
    index = np.argwhere(near)
    values[near] = evaluate(body.f, lower + spacing * index)
    return values, lower, spacing


def march(body: Body) -> tuple[Real, Indices, Body, float]:
    """Return the surface f = 0 by marching cubes, oriented outwards, cut where ``keep = 0``.

    Tunnels a few cells wide are plugged. Also returns the body with its plugs, and the grid
    spacing.
    """
    require(Extra.STANDINS, "making this surface", "skimage")
    values, lower, spacing = sample(body)
    grid = values.shape
    for attempt in range(9):
        _remove_strays(values, spacing)
        V, F = _cut_surface(body, values, lower, spacing)
        if topology.euler_characteristic(F, len(V)) == 2 - body.loops or attempt == 8:
            break
        plugs = plugs_for(V, F, spacing, min(0.03 + 0.015 * attempt, 0.09) * body.size)
        if not plugs:
            break
        for plug in plugs:
            low = np.floor((plug.centre - 2.6 * plug.radius - lower) / spacing).astype(int)
            high = np.ceil((plug.centre + 2.6 * plug.radius - lower) / spacing).astype(int) + 1
            low, high = np.clip(low, 0, grid), np.clip(high, 0, grid)
            axes = [np.arange(low[d], high[d]) for d in range(3)]
            index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            place = tuple(index.T)
            values[place] = plug.add(lower + spacing * index, values[place])
        body = replace(body, f=plugged(body.f, plugs))
    return V, F, body, spacing


def _remove_strays(values: Real, spacing: float) -> None:
    """Fill bubbles and drop islands in place, since they are not part of the surface."""
    for inside in (True, False):
        labels, count = scipy.ndimage.label(values < 0 if inside else values >= 0)
        if count > 1:
            sizes = np.bincount(labels.ravel())
            sizes[0] = 0
            stray = (labels > 0) & (labels != sizes.argmax())
            values[stray] = 0.5 * spacing if inside else -0.5 * spacing


def _cut_surface(body: Body, values: Real, lower: Real, spacing: float) -> tuple[Real, Indices]:
    """Return the surface of sampled values by marching cubes, cut by the body's `keep`."""
    from skimage.measure import marching_cubes

    V, F, _, _ = marching_cubes(values, 0.0)  # type: ignore[no-untyped-call] # has no type hints
    V, F = compact(lower + spacing * V.astype(np.float64), F.astype(np.int64))
    V = to_surface(body.f, V, 0.05 * spacing, 0.4 * spacing, rounds=2)
    some = F[::ORIENTED_BY]
    outwards = gradient(body.f, V[some].mean(axis=1), 0.05 * spacing)
    if (area_vectors(V, some) * outwards).sum() < 0:
        F = np.ascontiguousarray(F[:, ::-1])
    shape = Shape(body, 0.02 * spacing)
    return cut(V, F, body.keep, lambda p: shape.settle(p, spacing), spacing)


def cut(
    V: Real, F: Indices, keep: Field, settle: Callable[[Real], Real], spacing: float
) -> tuple[Real, Indices]:
    """Return the part of the mesh with ``keep >= 0``, with boundary vertices on ``keep = 0``.

    Vertices close to the cut are first moved onto it by `settle`, to avoid slivers.
    """
    g = evaluate(keep, V)
    close = np.flatnonzero(np.abs(g) < 0.25 * spacing)
    V = V.copy()
    V[close] = settle(V[close])
    g = evaluate(keep, V)
    g[np.abs(g) < 1e-3 * spacing] = 0.0
    sign = np.sign(g).astype(int)
    s = sign[F]
    pieces = [F[(s >= 0).all(axis=1) & (s > 0).any(axis=1)]]
    mixed = F[(s > 0).any(axis=1) & (s < 0).any(axis=1)]
    s = sign[mixed]
    edges = edges_of(mixed, len(V))
    crossing = edges.ends[sign[edges.ends].prod(axis=1) < 0]
    crossing = np.sort(crossing, axis=1)
    ga, gb = g[crossing[:, 0]], g[crossing[:, 1]]
    t = (ga / (ga - gb))[:, None]
    key = crossing[:, 0] * len(V) + crossing[:, 1]
    order = np.argsort(key)
    key = key[order]
    new = ((1 - t) * V[crossing[:, 0]] + t * V[crossing[:, 1]])[order]

    def between(a: Indices, b: Indices) -> Indices:
        return len(V) + np.searchsorted(key, np.minimum(a, b) * len(V) + np.maximum(a, b))

    for c in range(3):
        a, b, d = mixed[:, c], mixed[:, (c + 1) % 3], mixed[:, (c + 2) % 3]
        sa, sb, sd = s[:, c], s[:, (c + 1) % 3], s[:, (c + 2) % 3]
        for pattern, triangles in (
            ((1, -1, -1), lambda a, b, d: [(a, between(a, b), between(a, d))]),
            ((1, 0, -1), lambda a, b, d: [(a, b, between(a, d))]),
            ((1, -1, 0), lambda a, b, d: [(a, between(a, b), d)]),
            (
                (-1, 1, 1),
                lambda a, b, d: [(between(a, b), b, d), (between(a, b), d, between(a, d))],
            ),
        ):
            k = (sa == pattern[0]) & (sb == pattern[1]) & (sd == pattern[2])
            pieces += [np.stack(corners, axis=1) for corners in triangles(a[k], b[k], d[k])]
    V, F = compact(on_grid(np.concatenate([V, new])), np.concatenate(pieces))
    return largest_piece(V, F)


def largest_piece(V: Real, F: Indices) -> tuple[Real, Indices]:
    """Return the connected component with the most vertices."""
    count, label = topology.components(F, len(V))
    if count > 1:
        F = F[label[F[:, 0]] == np.bincount(label).argmax()]
    return compact(V, F)


# ---- sizes ----------------------------------------------------------------------------------


@dataclass
class Shape:
    """Keeps vertices on the surface: interior ones on f = 0, boundary ones also on keep = 0."""

    body: Body
    step: float

    def settle(self, p: Real, reach: float) -> Real:
        """Return points of the boundary curve near p."""
        return to_curve(self.body.f, self.body.keep, p, self.step, reach)

    def project(self, V: Real, F: Indices, reach: float, rounds: int = 3) -> Real:
        """Return all vertices projected back, a round by `reach` at most, and put on the grid."""
        return on_grid(self.nearest(V, F, reach, rounds))

    def nearest(self, V: Real, F: Indices, reach: float, rounds: int) -> Real:
        """Return all vertices projected back, as near as the rounds bring them."""
        rim = boundary_mask(F, len(V))
        V = V.copy()
        V[~rim] = to_surface(self.body.f, V[~rim], self.step, reach, rounds)
        V[rim] = self.settle(V[rim], reach)
        return V


def edge_length(area: float, faces: int) -> float:
    """Return the edge length of equilateral triangles, `faces` of which have this area."""
    return float(np.sqrt(4 * area / (np.sqrt(3) * faces)))


def relax(V: Real, F: Indices, shape: Shape, reach: float, strength: float = 0.6) -> Real:
    """Even out the vertices along the surface, and boundary vertices along the boundary."""
    n = len(V)
    edges = edges_of(F, n)
    ends = edges.ends[edges.on_boundary]
    rim = edges.rim(n)
    move = mean_of_neighbours(V, F) - V
    normal = vertex_normals(V, F)
    move -= normal * (move * normal).sum(axis=1, keepdims=True)
    along = np.zeros((n, 3))
    for a, b in (ends.T, ends.T[::-1]):
        np.add.at(along, a, 0.5 * V[b])
    move[rim] = along[rim] - V[rim]
    return shape.project(V + strength * move, F, reach, rounds=2)


class Sizes:
    """Target edge length: `inside` far from the boundary, `rim` on it, graded between them."""

    def __init__(self, V: Real, F: Indices, inside: float, rim: float) -> None:
        self.inside, self.rim = inside, rim
        self._tree = scipy.spatial.cKDTree(V[boundary_mask(F, len(V))])
        # The length changes by at most half of the distance.
        self._reach = 4 * max(abs(rim - inside), 0.25 * min(rim, inside))

    def at(self, p: Real) -> Real:
        """Return the target length at points (k, 3)."""
        d, _ = self._tree.query(p)
        # Not exp, whose last digit depends on the processor.
        return self.inside + (self.rim - self.inside) / (1 + d / self._reach) ** 2


def resize(V: Real, F: Indices, shape: Shape, sizes: Sizes) -> tuple[Real, Indices]:
    """Do one round of splits, collapses, flips and relaxation towards the target lengths."""
    for _ in range(3):
        edges = edges_of(F, len(V))
        ratio = _length(V, edges.ends) / sizes.at(V[edges.ends].mean(axis=1))
        long = np.flatnonzero(ratio > 4 / 3)
        if len(long) < 0.002 * len(ratio):
            break
        V, F = split(V, F, edges, long, ratio[long])
    for _ in range(4):
        edges = edges_of(F, len(V))
        ratio = _length(V, edges.ends) / sizes.at(V[edges.ends].mean(axis=1))
        short = np.flatnonzero(ratio < 4 / 5)
        before = len(V)
        V, F = collapse(V, F, edges, short, ratio[short])
        if before - len(V) < 0.002 * before:
            break
    F = delaunay_flips(V, F)
    V = relax(V, F, shape, 0.5 * sizes.inside)
    return V, delaunay_flips(V, F)


def _length(V: Real, ends: Indices) -> Real:
    return np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1)


def perimeter(V: Real, F: Indices) -> float:
    """Return the length of the boundary."""
    edges = edges_of(F, len(V))
    return float(_length(V, edges.ends[edges.on_boundary]).sum())


def area(V: Real, F: Indices) -> float:
    """Return the area of the surface."""
    return 0.5 * float(np.linalg.norm(area_vectors(V, F), axis=1).sum())


def to_boundary_count(V: Real, F: Indices, boundary: int, shape: Shape) -> tuple[Real, Indices]:
    """Split the longest or collapse the shortest boundary edges until there are `boundary`."""
    for _ in range(60):
        edges = edges_of(F, len(V))
        rim = np.flatnonzero(edges.on_boundary)
        surplus = len(rim) - boundary
        if surplus == 0:
            break
        length = _length(V, edges.ends[rim])
        order = np.argsort(length, kind="stable")
        if surplus > 0:
            some = order[: max(surplus, min(len(rim), 4 * surplus))]
            V, F = collapse(V, F, edges, rim[some], length[some], most=surplus)
        else:
            some = order[surplus:]
            V, F = split(V, F, edges, rim[some], length[some])
        V = relax(V, F, shape, float(length.mean()), 0.3)
        F = delaunay_flips(V, F)
    return V, F


def to_face_count(
    V: Real, F: Indices, faces: int, shape: Shape, sizes: Sizes | None = None
) -> tuple[Real, Indices]:
    """Split or collapse interior edges until there are `faces` triangles, or one more.

    The boundary is unchanged.
    """
    for _ in range(60):
        surplus = (len(F) - faces) // 2
        if surplus == 0:
            break
        edges = edges_of(F, len(V))
        rim = boundary_mask(F, len(V))
        inner = np.flatnonzero(~rim[edges.ends].any(axis=1))
        length = _length(V, edges.ends[inner])
        if sizes is not None:
            length = length / sizes.at(V[edges.ends[inner]].mean(axis=1))
        order = np.argsort(length, kind="stable")
        if surplus > 0:
            some = order[: min(len(order), 12 * surplus + 20)]
            V, F = collapse(V, F, edges, inner[some], length[some], most=surplus)
        else:
            some = order[max(0, len(order) + surplus) :]
            V, F = split(V, F, edges, inner[some], length[some])
        F = delaunay_flips(V, F)
    return V, F


def split_chords(V: Real, F: Indices) -> tuple[Real, Indices]:
    """Split interior edges between two boundary vertices, which violate Definition 1."""
    for _ in range(5):
        edges = edges_of(F, len(V))
        rim = boundary_mask(F, len(V))
        chords = np.flatnonzero(~edges.on_boundary & rim[edges.ends].all(axis=1))
        if not len(chords):
            break
        V, F = split(V, F, edges, chords, np.ones(len(chords)))
    return V, F


def split_stuck(V: Real, F: Indices, rounds: int = 20) -> tuple[Real, Indices]:
    """Split the few non-Delaunay edges that cannot be flipped: creases, duplicate diagonals.

    Halving an edge makes its opposite angles smaller, at the cost of two triangles. Without such
    edges every weight is positive and no harmonic map to a circle folds (Tutte).
    """
    for _ in range(rounds):
        edges = edges_of(F, len(V))
        weight = quads_of(F, edges).weight(V)
        stuck = np.flatnonzero(~edges.on_boundary)[weight < -1e-12]
        if not len(stuck):
            break
        V, F = split(V, F, edges, stuck, _length(V, edges.ends[stuck]))
        F = delaunay_flips(V, F)
    return V, F


def flip_ears(F: Indices, n: int) -> Indices:
    """Give every boundary vertex an interior neighbour by flipping the edge that cuts it off."""
    edges = edges_of(F, n)
    rim = np.bincount(edges.face[edges.on_boundary, 0], minlength=len(F))
    if not (rim > 1).any():
        return F
    quads = quads_of(F, edges)
    ear = np.flatnonzero((rim[quads.face] > 1).any(axis=1))
    return flip(F, quads.take(ear), np.ones(len(ear)), edges, n)[0]


# ---- the whole ------------------------------------------------------------------------------


def pymeshlab_remesh(V: Real, F: Indices, length: float, rounds: int = 6) -> tuple[Real, Indices]:
    """Return an isotropic explicit remesh with this edge length, by pymeshlab."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(V, F.astype(np.int32)))
    meshes.meshing_isotropic_explicit_remeshing(
        targetlen=pymeshlab.PureValue(length), iterations=rounds, checksurfdist=False
    )
    mesh = meshes.current_mesh()
    mesh.compact()
    return largest_piece(mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64))


def remesh(
    V: Real, F: Indices, faces: int, boundary: int, shape: Shape, use_pymeshlab: bool
) -> tuple[Real, Indices]:
    """Return a mesh of the same surface with these counts, as even inside as they allow."""
    target = edge_length(area(V, F), faces)
    if use_pymeshlab:
        V, F = pymeshlab_remesh(V, F, target)
        V = shape.project(V, F, target)
    inside = target
    for k in range(7):
        sizes = Sizes(V, F, inside, perimeter(V, F) / boundary)
        V, F = resize(V, F, shape, sizes)
        # The rounds of collapses and splits do not reach the exact count by themselves.
        inside *= float(np.clip(np.sqrt(len(F) / faces), 0.7, 1.4))
        if k >= 2 and abs(len(F) / faces - 1) < 0.02:
            break
    V, F = to_boundary_count(V, F, boundary, shape)
    V, F = split_chords(V, F)
    V, F = to_face_count(V, F, faces, shape, Sizes(V, F, inside, perimeter(V, F) / boundary))
    for _ in range(3):
        V = relax(V, F, shape, 0.5 * target)
        F = delaunay_flips(V, F)
    return V, F


def mesh_of(
    mesh_type: type[M],
    body: Body,
    faces: int,
    boundary: int,
    *,
    name: str,
    use_pymeshlab: bool | None = None,
) -> M:
    """Return the surface of `body` with `faces` triangles and `boundary` boundary vertices in all.

    `mesh_type` is DiskMesh for a body with one boundary loop, HoledMesh for more. The counts are
    exact, up to one triangle if their parities disagree and two for each edge that has to be split
    because it cannot be flipped (about ten in a million). The mesh's notices say whether
    pymeshlab's filter was missing; `use_pymeshlab` overrides that check.

    Raises
    ------
    MeshError
        The surface has the wrong topology: there are too few triangles for its features.
    """
    use = has_remeshing_filter() if use_pymeshlab is None else use_pymeshlab
    V, F, body, spacing = march(body)
    shape = Shape(body, 0.02 * spacing)
    levels = 0
    while faces / 4**levels > BASE:
        levels += 1
    V, F = remesh(V, F, round(faces / 4**levels), round(boundary / 2**levels), shape, use)
    for _ in range(levels):
        V, F = subdivide(V, F)
        reach = edge_length(area(V, F), len(F))
        V = shape.project(V, F, 0.5 * reach)
        F = delaunay_flips(V, F)
        V = relax(V, F, shape, 0.3 * reach)
        F = delaunay_flips(V, F)
    V, F = to_boundary_count(V, F, boundary, shape)
    V, F = to_face_count(V, F, faces, shape)
    V = shape.project(V, F, 0.3 * edge_length(area(V, F), len(F)), rounds=4)
    F = delaunay_flips(V, F)
    V, F = split_stuck(V, F)
    V, F = split_chords(V, F)
    F = flip_ears(F, len(V))
    try:
        return mesh_type.from_arrays(V, F, name=name, notices=() if use else (FALLBACK_NOTE,))
    except MeshError as error:
        raise MeshError(
            f"{name} with {faces} faces is unusable: {error} Ask for more faces."
        ) from error


def break_delaunay(V: Real, F: Indices, seed: int, share: float) -> Indices:
    """Flip edges, chosen by `seed`, until about `share` of the interior ones are not Delaunay.

    Mild cases, as in scanned meshes: the two angles opposite to the edge sum to slightly more than
    180 degrees. An edge's chance is that of its ends, so that one edge more elsewhere changes none.
    """
    rng = np.random.default_rng(seed)
    n = len(V)
    for _ in range(30):
        edges = edges_of(F, n)
        quads = quads_of(F, edges)
        weight = quads.weight(V)
        missing = round((share - (weight < -1e-10).mean()) * len(weight))
        if missing <= 0.02 * share * len(weight):
            break
        flipped = quads.flipped_weight(V)
        rim = edges.rim(n)
        mild = (weight >= 0) & (flipped < -1e-3) & (flipped > -0.8) & ~quads.folds(V)
        mild &= ~rim[quads.p] & ~rim[quads.q] & ~rim[quads.i] & ~rim[quads.j]
        chance = rng.random(n)
        order = np.argsort((chance[quads.i] + chance[quads.j]) % 1, kind="stable")
        some = order[mild[order]][: max(1, round(0.8 * missing))]
        if not len(some):
            break
        F, _ = flip(F, quads.take(some), -weight[some], edges, n)
    return F
