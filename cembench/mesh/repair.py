"""Repair a triangle soup until it is an oriented manifold, and report every step.

The steps are made in the order of :class:`Step`; each may rely on the previous ones and undoes none
of them. docs/repair.md says what each does, and why it comes where it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from cembench.core.arrays import Indices, Mask, Points, marked
from cembench.core.errors import MeshError, ParameterError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology
from cembench.mesh.defects import (
    Defect,
    RepairLossError,
    UnusableMeshError,
    degenerate,
    duplicates,
    examine,
    oriented,
    out_of_scale,
    representatives,
)
from cembench.mesh.gluing import edges_of_half_edges, glue, paired_half_edges
from cembench.mesh.polygons import triangulate
from cembench.mesh.seams import are_copies, coincident_vertices, tolerances_of_gaps
from cembench.mesh.side_lengths import loop_width, side_lengths
from cembench.mesh.t_junctions import split_t_junctions

Components = Literal["largest", "all"]

#: A degenerate triangle with an edge below this share of its longest one is collapsed.
_NEEDLE = 1e-6
#: A repair may lose this share of the area without being asked.
_SMALL = 0.01
#: A note says how much is kept of the area if it is less than this share.
_TOLD = 0.9999
#: A boundary is ragged if its ears are more than this share of its sides. A rectangular grid whose
#: corners have less than :data:`_SMALL` of its area is not: k by l cells have at most 4 ears, on
#: 2 (k + l) sides, and k l > 200.
_RAGGED = 1 / 12
#: Rounds of flips: flipping a degenerate triangle can make its neighbour degenerate.
_FLIP_ROUNDS = 10


class Step(StrEnum):
    """The steps of a repair in order: the name in JSON, which is the value, and the meaning."""

    meaning: str

    def __new__(cls, name: str, meaning: str) -> Self:
        """Return a member whose value is its name in JSON."""
        member = str.__new__(cls, name)
        member._value_, member.meaning = name, meaning
        return member

    invalid_faces = "invalid_faces_dropped", "faces with a missing or non-finite vertex dropped"
    polygons = "polygons_triangulated", "polygons cut into triangles"
    weld = "vertices_welded", "coincident vertices welded"
    kept_open = "coincident_vertices_kept", "coincident vertices of a cut kept apart"
    collapse = "degenerate_triangles_collapsed", "degenerate triangles collapsed"
    flip = "degenerate_triangles_flipped", "degenerate triangles flipped"
    degenerate = "degenerate_triangles_dropped", "degenerate triangles dropped"
    duplicate = "duplicate_triangles_dropped", "duplicate triangles dropped"
    t_junctions = "t_junctions_split", "sides divided at vertices on them"
    edges = "non_manifold_edges_split", "non-manifold edges split"
    vertices = "non_manifold_vertices_split", "non-manifold vertices split"
    orient = "triangles_turned_over", "triangles turned over"
    one_sided = "edges_of_one_sided_surfaces_cut", "edges of one-sided surfaces cut"
    outwards = "closed_components_turned_outwards", "closed components turned outwards"
    components = "components_dropped", "components dropped"
    component_faces = "triangles_of_dropped_components", "triangles of dropped components"
    ears = "ears_dropped", "ears dropped"
    holes = "holes_filled", "holes filled"
    isolated = "isolated_vertices_removed", "isolated vertices removed"


class Kept(NamedTuple):
    """How much of a surface a repair keeps."""

    #: Share of the area; duplicate triangles do not count, those without area neither.
    area: float
    triangles: int
    triangles_before: int
    #: Connected pieces, after welding.
    pieces: int
    pieces_before: int

    @property
    def is_whole(self) -> bool:
        """Whether no piece and no more than :data:`_SMALL` of the area is lost."""
        return self.pieces == self.pieces_before and self.area >= 1 - _SMALL

    def __str__(self) -> str:
        return (
            f"{100 * self.area:.4g} % of the area, {self.triangles:,} of "
            f"{self.triangles_before:,} triangles and {self.pieces:,} of "
            f"{self.pieces_before:,} pieces"
        )


@dataclass(frozen=True)
class Repaired:
    """Surfaces that are oriented manifolds, and the repairs that were made."""

    #: Vertices (n, 3) and triangles (m, 3) of each surface, most triangles first.
    surfaces: tuple[tuple[Points, Indices], ...]
    #: The count of each step, zeros included.
    steps: dict[Step, int]
    #: For each surface the input vertex (n,) of each vertex, and the input face (m,) of each
    #: triangle; -1 for those that fill holes.
    origins: tuple[tuple[Indices, Indices], ...]
    kept: Kept

    @property
    def counts(self) -> dict[str, int]:
        """The count of each step, by its name in JSON."""
        return {step.value: n for step, n in self.steps.items()}

    @property
    def notices(self) -> tuple[Notice, ...]:
        """One notice for each step that changed something, and what is kept if not all is."""
        texts = [f"{n:,} {step.meaning}" for step, n in self.steps.items() if n]
        if self.kept.area < _TOLD or not self.kept.is_whole:
            texts.append(f"{self.kept} are kept")
        return tuple(Notice(NoticeKind.REPAIRED, f"repaired: {text}") for text in texts)


def repair(
    V: ArrayLike,
    faces: ArrayLike,
    sizes: Indices | None = None,
    *,
    weld: float | None = None,
    fill_holes: int = 0,
    components: Components = "largest",
    drop: bool = False,
    copies: bool | None = None,
) -> Repaired:
    """Make oriented manifolds out of vertices and faces of any quality.

    Parameters
    ----------
    V : float (n, 3)
        Vertices; NaN and infinity are allowed.
    faces : integers (k, c)
        Vertex indices, counted from 0; c is 3 for triangles. With `sizes` all in one row.
    sizes : int64 (k,), optional
        The number of corners of each polygon, at least 3, where these differ.
    weld : float, optional
        Vertices at most this far apart, in the units of `V`, become one; 0 welds vertices that
        coincide exactly. By default these are welded unless the surface is a disk, or has holes,
        and they seem to be a cut.
    fill_holes : int
        Boundary loops with at most this many edges are filled, except the longest of a component.
    components : {"largest", "all"}
        Which connected components are kept; each is a separate surface.
    drop : bool
        Whether a piece, or more than 1 % of the area, may be lost.
    copies : bool, optional
        Whether coincident vertices are copies that the file's format needs (True), or a cut
        (False). By default :func:`cembench.mesh.seams.are_copies` decides.

    Returns
    -------
    Repaired
        The surfaces, and the count of each step.

    Raises
    ------
    ParameterError
        A tolerance or a number of edges is below 0, a tolerance welds each triangle to nothing, or
        `components` is unknown.
    RepairLossError
        A piece, or more than 1 % of the area, would be lost, and `drop` is False.
    UnusableMeshError
        The coordinates are too large or too small to compute with.
    MeshError
        Nothing is left: all faces were degenerate or had a missing vertex.

    Examples
    --------
    >>> import numpy as np
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]])
    >>> found = repair(V, np.array([[0, 1, 2], [2, 0, 3], [0, 1, 2]]))
    >>> len(found.surfaces), found.counts["duplicate_triangles_dropped"]
    (1, 1)
    """
    _check_options(weld, fill_holes, components)
    steps = dict.fromkeys(Step, 0)
    points = np.array(V, dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(faces, dtype=np.int64)
    sizes = np.full(len(faces), faces.shape[-1]) if sizes is None else sizes
    F, face = _triangles(points, faces.ravel(), sizes, steps)
    steps[Step.isolated] = len(points) - len(np.unique(F))  # removed with all unused vertices
    given, F = F, _weld(points, F, weld, copies, steps)
    wrong_scale = out_of_scale(points, F)
    if wrong_scale is not None:
        raise UnusableMeshError([wrong_scale])
    before = _Measured.of(points, F, steps[Step.invalid_faces])
    F, face = _repair_degenerate(points, F, face, steps)
    extra = duplicates(F) if len(F) else np.zeros(0, dtype=bool)
    steps[Step.duplicate] = int(extra.sum())
    F, face = F[~extra], face[~extra]
    if not len(F):
        raise _nothing_left(points, given, weld)
    if not steps[Step.kept_open]:
        F, parent, steps[Step.t_junctions] = split_t_junctions(points, F)
        face = face[parent]
    F, origin = _split(points, F, steps)
    F, turned = _orient(F, len(origin), steps)
    origin = origin[turned]
    F = _outwards(points[origin], F, steps)
    surfaces: list[tuple[Points, Indices]] = []
    origins: list[tuple[Indices, Indices]] = []
    for chosen in _components(F, len(origin), components, steps):
        chosen = chosen[_without_ears(points[origin], F[chosen], steps)]
        used, own = np.unique(F[chosen], return_inverse=True)
        own = own.reshape(-1, 3).astype(np.int64)
        surface = _fill_holes(points[origin[used]], own, fill_holes, steps)
        added = [len(new) - len(old) for new, old in zip(surface, (used, own), strict=True)]
        old = origin[used], face[chosen]
        surfaces.append(surface)
        of_vertices, of_faces = (
            np.append(k, np.full(a, -1)) for k, a in zip(old, added, strict=True)
        )
        origins.append((of_vertices, of_faces))
    kept = before.kept_by(surfaces, origins)
    if not (drop or kept.is_whole):
        raise _loss(points, faces.ravel(), sizes, kept, weld, components)
    return Repaired(tuple(surfaces), steps, tuple(origins), kept)


@dataclass(frozen=True)
class _Measured:
    """Areas and pieces of welded triangles, before any is dropped."""

    area: float
    count: int
    piece: Indices  #: of each input vertex; -1 for those in no triangle with an area

    @classmethod
    def of(cls, V: Points, F: Indices, missing: int) -> _Measured:
        """Measure triangles; `missing` faces, whose area is unknown, have that of the mean."""
        whole = F[~degenerate(V, F)] if len(F) else F
        single = whole[~duplicates(whole)] if len(whole) else whole
        areas = _areas(V, single)
        piece = np.full(len(V), -1)
        if len(single):
            used = np.unique(single)
            piece[used] = topology.components(single, len(V))[1][used]
        total = float(areas.sum()) * (1 + missing / max(len(single), 1))
        return cls(total, len(single) + missing, piece)

    def kept_by(
        self, surfaces: Sequence[tuple[Points, Indices]], origins: Sequence[tuple[Indices, Indices]]
    ) -> Kept:
        """Return what these surfaces keep; triangles that fill holes do not count."""
        area, count, pieces = 0.0, 0, [np.array([-1])]
        for (V, F), (vertices, faces) in zip(surfaces, origins, strict=True):
            area += float(_areas(V, F[faces >= 0]).sum())
            count += int((faces >= 0).sum())
            pieces.append(self.piece[vertices[vertices >= 0]])
        share = min(area / self.area, 1.0) if self.area else 1.0
        there = len(np.unique(self.piece[self.piece >= 0]))
        left = len(np.unique(np.concatenate(pieces))) - 1
        return Kept(share, count, max(self.count, count), left, there)


def _areas(V: Points, F: Indices) -> Points:
    a, b, c = (V[F[:, k]] for k in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def options_without_loss(
    V: Points, corners: Indices, sizes: Indices
) -> tuple[dict[str, float | str], Kept] | None:
    """Return options with which a repair keeps the whole surface, tried on it, and what it keeps.

    Welding comes first: at the gaps between boundary vertices. None if no option does.
    """
    F, _ = _triangles(V, corners, sizes, dict.fromkeys(Step, 0))
    F = coincident_vertices(V, F)[F] if len(F) else F
    tried: list[dict[str, Any]] = [{"weld": one} for one in tolerances_of_gaps(V, F)]
    for options in (*tried, {"components": "all"}):
        try:
            return options, repair(V, corners, sizes, **options).kept
        except (MeshError, ParameterError):
            continue
    return None


def _loss(
    V: Points,
    corners: Indices,
    sizes: Indices,
    kept: Kept,
    weld: float | None,
    components: Components,
) -> RepairLossError:
    """Return the error that a repair would lose part of a surface, with the way to keep it."""
    if weld is None and components == "largest":  # else the user has chosen
        found = options_without_loss(V, corners, sizes)
        if found is not None:
            return RepairLossError(kept, *found)
    return RepairLossError(kept, {})


def _nothing_left(V: Points, F: Indices, weld: float | None) -> MeshError | ParameterError:
    """Return the error that no triangle is left, and whether the tolerance is the cause."""
    sides = side_lengths(V, F[~degenerate(V, F)])
    if weld and len(sides):
        return ParameterError(
            f"weld={weld!r} leaves nothing: at this tolerance every triangle has corners that "
            f"become one. The shortest side has the length {sides.min():.3g}, the longest "
            f"{sides.max():.3g}; give a tolerance well below most sides."
        )
    return MeshError(
        "nothing can be repaired: every face is degenerate or has a missing vertex. The file is "
        "damaged; export it again."
    )


def _check_options(weld: float | None, fill_holes: int, components: str) -> None:
    """Raise :class:`ParameterError` for options out of range."""
    if weld is not None and not (np.isfinite(weld) and weld >= 0):
        raise ParameterError(f"weld={weld!r} is not allowed; a tolerance is 0 or a finite length.")
    if fill_holes < 0:
        raise ParameterError(f"fill_holes={fill_holes} is not allowed; give 0 or more edges.")
    if components not in ("largest", "all"):
        raise ParameterError(f"components={components!r} is unknown; allowed: 'largest', 'all'.")


def _triangles(
    V: Points, corners: Indices, sizes: Indices, steps: dict[Step, int]
) -> tuple[Indices, Indices]:
    """Cut the faces whose vertices exist and are finite into triangles; also return their faces."""
    polygon = np.repeat(np.arange(len(sizes)), sizes)
    finite = np.append(np.isfinite(V).all(axis=1), False)
    inside = (corners >= 0) & (corners < len(V))
    bad = marked(len(sizes), polygon[~finite[np.where(inside, corners, -1)]])
    corners, sizes = corners[~bad[polygon]], sizes[~bad]
    steps[Step.invalid_faces] = int(bad.sum())
    steps[Step.polygons] = int((sizes > 3).sum())
    return corners[triangulate(V, corners, sizes)], np.repeat(np.flatnonzero(~bad), sizes - 2)


def _weld(
    V: Points, F: Indices, tolerance: float | None, copies: bool | None, steps: dict[Step, int]
) -> Indices:
    """Replace coincident vertices in the triangles by one of them; the others become isolated."""
    if tolerance and not (side_lengths(V, F) > tolerance).any():
        return F[:0]  # soon told, where the pairs of vertices would fill memory
    used, compact = np.unique(F, return_inverse=True)
    compact = compact.reshape(-1, 3)
    points = V[used]
    if tolerance is None:
        same = coincident_vertices(points, compact)
    else:
        same = representatives(points, tolerance)
    extra = int((same != np.arange(len(used))).sum())
    if (
        tolerance is None
        and extra
        and not (are_copies(compact, same) if copies is None else copies)
        and _can_be_mapped(points, compact)
    ):
        steps[Step.kept_open] = extra
        return F
    steps[Step.weld] = extra
    number = np.arange(len(V))
    number[used] = used[same]
    return number[F]


def _can_be_mapped(V: Points, F: Indices) -> bool:
    """Whether triangles, apart from degenerate ones, are a disk or have holes, without handles.

    A connected manifold with b boundary loops is one if its Euler characteristic is 2 - b.
    """
    edges, _, faces = edges_of_half_edges(F)
    rim, ends = np.unique(edges[faces == 1], return_inverse=True)
    if not len(rim):
        return False
    loops = topology.components(ends.reshape(-1, 2), len(rim))[0]
    if len(V) - len(edges) + len(F) != 2 - loops:
        return False
    harmless = {Defect.scale, Defect.coincident, Defect.degenerate, Defect.orientation}
    return {problem.defect for problem in examine(V, F, connected=True).problems} <= harmless


def _repair_degenerate(
    V: Points, F: Indices, face: Indices, steps: dict[Step, int]
) -> tuple[Indices, Indices]:
    """Collapse needles, flip triangles with collinear corners, drop the rest."""
    for _ in range(_FLIP_ROUNDS):
        keep = ~_repeats_a_vertex(F)
        steps[Step.degenerate] += int((~keep).sum())
        F, face = F[keep], face[keep]
        bad = np.flatnonzero(degenerate(V, F))
        if not len(bad):
            return F, face
        F, collapsed = _collapse_needles(V, F, bad)
        steps[Step.collapse] += collapsed
        steps[Step.degenerate] -= collapsed  # the next round drops what a collapse leaves
        if not collapsed:
            F, flipped = _flip(V, F, bad)
            steps[Step.flip] += flipped
            if not flipped:
                break
    keep = ~(_repeats_a_vertex(F) | degenerate(V, F))
    steps[Step.degenerate] += int((~keep).sum())
    return F[keep], face[keep]


def _repeats_a_vertex(F: Indices) -> Mask:
    """Whether each triangle has a vertex twice."""
    return np.asarray((np.roll(F, 1, axis=1) == F).any(axis=1))


def _half_edge_lengths(V: Points, F: Indices) -> Points:
    """Return the length of each side of each triangle, (m, 3); side c starts at corner c."""
    return np.roll(side_lengths(V, F), 1, axis=1)


def _collapse_needles(V: Points, F: Indices, bad: Indices) -> tuple[Indices, int]:
    """Merge the ends of the shortest side of degenerate triangles if it is negligible."""
    lengths = _half_edge_lengths(V, F[bad])
    needles = lengths.min(axis=1) <= _NEEDLE * lengths.max(axis=1)
    if not needles.any():
        return F, 0
    side = lengths[needles].argmin(axis=1)
    corners = F[bad[needles]]
    row = np.arange(len(corners))
    ends = np.sort(np.stack([corners[row, side], corners[row, (side + 1) % 3]], axis=1), axis=1)
    number = np.arange(len(V))
    np.minimum.at(number, ends[:, 1], ends[:, 0])
    while (number[number] != number).any():
        number = number[number]
    return number[F], int(_repeats_a_vertex(number[F]).sum())


def _flip(V: Points, F: Indices, bad: Indices) -> tuple[Indices, int]:
    """Replace the longest side of flat triangles by the other diagonal of the quadrilateral.

    No edge may appear twice, and no triangle takes part in two flips of a round.
    """
    F = F.copy()
    edges, edge, faces = edges_of_half_edges(F)
    stride = len(V)
    present = set((edges[:, 0] * stride + edges[:, 1]).tolist())
    partner = np.full(F.size, -1)
    pairs = paired_half_edges(edge, faces)
    partner[pairs[:, 0]], partner[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    touched: set[int] = set()
    flips = 0
    side = _half_edge_lengths(V, F[bad]).argmax(axis=1)
    for t, c in zip(bad.tolist(), side.tolist(), strict=True):
        other = int(partner[3 * t + c])
        s, d = divmod(other, 3)
        if other < 0 or touched & {s, t}:
            continue
        tip = int(F[t, (c + 2) % 3])
        end, start, far = (int(F[s, (d + k) % 3]) for k in range(3))
        diagonal = min(tip, far) * stride + max(tip, far)
        if tip == far or diagonal in present:
            continue
        F[t], F[s] = (tip, start, far), (tip, far, end)  # with the orientation of the neighbour
        present.add(diagonal)
        touched |= {s, t}
        flips += 1
    return F, flips


def _split(V: Points, F: Indices, steps: dict[Step, int]) -> tuple[Indices, Indices]:
    """Split edges with more than two triangles, and vertices with more than one fan."""
    _, edge, faces = edges_of_half_edges(F)
    pairs = np.concatenate([paired_half_edges(edge, faces), _smoothest_pairs(V, F, edge, faces)])
    steps[Step.edges] = int((faces > 2).sum())
    while True:
        glued, origin = glue(F, pairs, len(V))
        _, edge, faces = edges_of_half_edges(glued)
        # Two separated sheets can still share both ends of an edge.
        good = faces[edge[pairs[:, 0]]] == 2
        if good.all():
            break
        pairs = pairs[good]
    steps[Step.vertices] = len(np.unique(origin[len(V) :]))
    return glued, origin


def _smoothest_pairs(V: Points, F: Indices, edge: Indices, faces: Indices) -> Indices:
    """Return the pairs of half-edges (k, 2) that stay connected where an edge has three or more.

    The smoothest pairs first: the angle between the two triangles is closest to straight. If the
    input's orientations agree elsewhere, they must agree here too.
    """
    crowded = np.flatnonzero(faces[edge] > 2)
    chosen: list[tuple[int, int]] = []
    if not len(crowded):
        return np.empty((0, 2), dtype=np.int64)
    left, right = paired_half_edges(edge, faces).T
    trusted = not (F.ravel()[left] == F.ravel()[right]).any()
    crowded = crowded[np.argsort(edge[crowded], kind="stable")]
    t, c = np.divmod(crowded, 3)
    tail, head, tip = F[t, c], F[t, (c + 1) % 3], F[t, (c + 2) % 3]
    forwards = tail < head
    along = V[np.maximum(tail, head)] - V[np.minimum(tail, head)]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    inwards = V[tip] - V[tail]
    inwards -= (inwards * along).sum(axis=1, keepdims=True) * along
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    bounds = np.flatnonzero(np.diff(edge[crowded], prepend=-1, append=-1))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        cosine = inwards[first:last] @ inwards[first:last].T
        i, j = np.triu_indices(last - first, 1)
        if trusted:
            opposite = forwards[first + i] != forwards[first + j]
            i, j = i[opposite], j[opposite]
        free = np.ones(last - first, dtype=bool)
        for k in np.argsort(cosine[i, j], kind="stable"):
            if free[i[k]] and free[j[k]]:
                free[[i[k], j[k]]] = False
                chosen.append((int(crowded[first + i[k]]), int(crowded[first + j[k]])))
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)


def _orient(F: Indices, n: int, steps: dict[Step, int]) -> tuple[Indices, Indices]:
    """Orient each piece consistently, and cut one-sided ones where triangles contradict."""
    given, (F, turned, contradictions) = F, oriented(F)
    steps[Step.orient] = int(turned.sum())
    if not len(contradictions):
        return F, np.arange(n)
    F = _straightened(F)
    pairs, agree = _agreeing(F)
    steps[Step.orient] = int((given != F).any(axis=1).sum())
    steps[Step.one_sided] = int((~agree).sum())
    return glue(F, pairs[agree], n)


def _agreeing(F: Indices) -> tuple[Indices, Mask]:
    """Return the pairs of half-edges (k, 2), and whether the two triangles of each agree."""
    _, edge, faces = edges_of_half_edges(F)
    pairs = paired_half_edges(edge, faces)
    return pairs, F.ravel()[pairs[:, 0]] != F.ravel()[pairs[:, 1]]


def _straightened(F: Indices) -> Indices:
    """Turn over triangles that contradict two neighbours or three, until there are none.

    A cut along what is left hangs no triangle on by one side.
    """
    pairs, agree = _agreeing(F)
    pair = np.full(F.size, -1)
    pair[pairs.ravel()] = np.repeat(np.arange(len(pairs)), 2)
    sides = pair.reshape(-1, 3)
    turned = np.zeros(len(F), dtype=bool)
    queue = np.unique(pairs[~agree] // 3).tolist()
    while queue:
        t = queue.pop()
        own = sides[t][sides[t] >= 0]
        if (~agree[own]).sum() >= 2:  # turning it lowers the number of contradictions
            agree[own] = ~agree[own]
            turned[t] = ~turned[t]
            queue += (pairs[own] // 3).ravel().tolist()
    return np.where(turned[:, None], F[:, ::-1], F)


def _outwards(V: Points, F: Indices, steps: dict[Step, int]) -> Indices:
    """Reverse closed components with negative enclosed volume; open ones have no outside."""
    count, label = topology.components(F, len(V))
    piece = label[F[:, 0]]
    _, edge, faces = edges_of_half_edges(F)
    closed = ~marked(count, np.repeat(piece, 3)[faces[edge] == 1])
    centre = V - V[F].mean(axis=(0, 1))
    a, b, c = (centre[F[:, k]] for k in range(3))
    volume = np.bincount(piece, np.einsum("td,td->t", a, np.cross(b, c)), minlength=count)
    inside_out = closed & (volume < 0)
    steps[Step.outwards] = int(inside_out.sum())
    return np.where(inside_out[piece][:, None], F[:, ::-1], F)


def _components(F: Indices, n: int, wanted: Components, steps: dict[Step, int]) -> list[Indices]:
    """Return the numbers of the triangles of each component that is kept, the largest first."""
    _, label = topology.components(F, n)
    pieces, piece, sizes = np.unique(label[F[:, 0]], return_inverse=True, return_counts=True)
    order = np.argsort(-sizes, kind="stable")
    if wanted == "largest":
        steps[Step.components] = len(pieces) - 1
        steps[Step.component_faces] = int(len(F) - sizes[order[0]])
        order = order[:1]
    by_piece = np.split(np.argsort(piece, kind="stable"), np.cumsum(sizes)[:-1])
    return [by_piece[k] for k in order]


def _without_ears(V: Points, F: Indices, steps: dict[Step, int]) -> Mask:
    """Whether each triangle stays when ears, with two sides on the boundary, are dropped.

    Those of holes fold in a map to a disk with round holes. Those of the outer boundary, the widest
    loop, stay unless it is ragged. None is dropped where they have more than :data:`_SMALL` of the
    area.
    """
    loops, areas = topology.boundary_loops(F, len(V)), _areas(V, F)
    widest = max(loops, key=lambda loop: loop_width(V[loop]), default=np.zeros(0, np.int64))
    stays = np.asarray(np.isin(F, widest).any(axis=1))
    if (_ears(F) & stays).sum() > _RAGGED * len(widest):
        stays[:] = False
    keep = np.ones(len(F), dtype=bool)
    while (ears := _ears(F[keep]) & ~stays[keep]).any():
        keep[np.flatnonzero(keep)[ears]] = False
    if areas[~keep].sum() > _SMALL * areas.sum():
        return np.ones(len(F), dtype=bool)
    steps[Step.ears] += int((~keep).sum())
    return keep


def _ears(F: Indices) -> Mask:
    """Whether each triangle has two sides or three on the boundary."""
    _, edge, faces = edges_of_half_edges(F)
    return np.asarray((faces[edge] == 1).reshape(-1, 3).sum(axis=1) >= 2)


def _fill_holes(V: Points, F: Indices, most: int, steps: dict[Step, int]) -> tuple[Points, Indices]:
    """Fill loops with at most `most` edges, except the longest.

    A triangle fills three edges; a fan around a new central vertex fills more, so that no new edge
    can already exist elsewhere.
    """
    loops = topology.boundary_loops(F, len(V)) if most else []
    if len(loops) < 2:
        return V, F
    around = [np.linalg.norm(V[loop] - V[np.roll(loop, 1)], axis=1).sum() for loop in loops]
    del loops[int(np.argmax(around))]
    new_points: list[Points] = []
    new_faces: list[Indices] = []
    for loop in loops:
        if len(loop) > most:
            continue
        following = np.roll(loop, -1)
        steps[Step.holes] += 1
        if len(loop) == 3:
            new_faces.append(loop[None, ::-1])
            continue
        centre = np.full(len(loop), len(V) + len(new_points))
        new_points.append(V[loop].mean(axis=0))
        new_faces.append(np.stack([following, loop, centre], axis=1))
    if not new_faces:
        return V, F
    return np.vstack([V, *new_points]), np.concatenate([F, *new_faces])
