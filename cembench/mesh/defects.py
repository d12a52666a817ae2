"""Defects of vertices and triangles that should form a surface.

Every defect has a kind, a count and a sentence. :class:`UnusableMeshError` holds all defects of a
mesh, so that a user can repair them in one go.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.arrays import Indices, Mask, Points, marked
from cembench.core.blocks import blocks
from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology
from cembench.mesh.gluing import vertices_of_several_fans

#: A triangle is degenerate if its area is below this share of its longest edge squared.
DEGENERATE_AREA = 1e-15
#: Below this share a triangle is kept with a notice: its cotangents lose digits.
SLIVER_AREA = 1e-6
#: Allowed range of coordinates and edges, since fourth powers of lengths are computed.
LARGEST_LENGTH = 1e60
SMALLEST_LENGTH = 1e-60


class Defect(StrEnum):
    """Kinds of defects of a surface, in the order in which a repair treats them."""

    not_finite = "not finite"
    out_of_range = "out of range"
    scale = "scale"
    coincident = "coincident vertices"
    degenerate = "degenerate triangles"
    duplicate = "duplicate triangles"
    edges = "non-manifold edges"
    vertices = "non-manifold vertices"
    orientation = "inconsistent orientation"
    one_sided = "one-sided"
    components = "several components"
    isolated = "isolated vertices"
    holes = "holes"
    no_hole = "no hole"
    closed = "closed"
    handles = "handles"


class Remedy(StrEnum):
    """Ways to remove a defect; most are commands."""

    repair = "repair"
    fill = "fill"
    cut = "cut"
    rescale = "rescale"
    other_algorithm = "other algorithm"


_REMEDIES = {
    Defect.scale: Remedy.rescale,
    Defect.holes: Remedy.fill,
    Defect.no_hole: Remedy.other_algorithm,
    Defect.closed: Remedy.cut,
    Defect.handles: Remedy.cut,
}


@dataclass(frozen=True)
class Problem:
    """One kind of defect of a surface, its count and its first occurrence."""

    defect: Defect
    #: Number of affected vertices, triangles, edges, pieces, loops or handles.
    count: int
    #: What is wrong, where, and what is allowed; without a full stop.
    text: str
    #: For holes: number of edges of the largest one that would have to be filled.
    edges: int = 0
    #: The way to remove it, where that is not the usual one.
    other_remedy: Remedy | None = None

    @property
    def remedy(self) -> Remedy:
        """The way to remove this defect."""
        return self.other_remedy or _REMEDIES.get(self.defect, Remedy.repair)


class UnusableMeshError(MeshError):
    """A surface with defects: `problems` lists them all, and the message names the remedies.

    `path` is the surface's file, `where` a surface in it, `options` those of a repair that keeps
    the whole surface, `notices` on what else cannot be right.
    """

    def __init__(
        self,
        problems: Sequence[Problem],
        path: Path | None = None,
        where: str = "",
        options: Mapping[str, float | str] | None = None,
        notices: tuple[Notice, ...] = (),
    ) -> None:
        self.problems, self.notices = tuple(problems), notices
        self.path, self.where, self.options = path, where, dict(options or {})
        super().__init__(self.problems, path, where, self.options, notices)

    def __str__(self) -> str:
        where = "".join(f"{place}: " for place in (self.path, self.where) if place)
        remedies = " ".join(_remedies(self.problems, self.path, self.options))
        remedies += "".join(f"\nNote: {notice}." for notice in self.notices)
        if len(self.problems) == 1:
            return f"{where}{self.problems[0].text}. {remedies}"
        lines = "".join(f"\n  {k}. {p.text}." for k, p in enumerate(self.problems, start=1))
        return f"{where}{len(self.problems)} problems:{lines}\n{remedies}"


def repair_advice(path: Path | None, options: Mapping[str, object]) -> str:
    """Return the command that repairs a file with these options; without a file, the call."""
    if path is None:
        call = "".join(f", {name}={value!r}" for name, value in options.items())
        return f"`cembench.repair(surface{call}).mesh`"
    words = [f"--{k.replace('_', '-')}" + f" {v}" * (v is not True) for k, v in options.items()]
    file, repaired = shlex.quote(str(path)), _named(path, "repaired")
    return f"`{' '.join(['cembench repair', file, '-o', repaired, *words])}`"


def _named(path: Path, what: str) -> str:
    """Return the name of a file that a command writes."""
    return f"{shlex.quote(path.stem + '_' + what)}.obj"


def _remedies(
    problems: Sequence[Problem], path: Path | None, options: Mapping[str, object]
) -> Iterator[str]:
    """Yield what makes a surface usable, in the order of its use."""
    needed = {p.remedy for p in problems}
    if Remedy.rescale in needed:
        yield "Angles do not depend on the scale: divide all coordinates by the same number."
    fill = {"fill_holes": max(p.edges for p in problems)} if Remedy.fill in needed else {}
    repairs = Remedy.repair in needed
    if repairs or fill:
        does = "mends this" if len(problems) == 1 else "repairs what can be repaired"
        does = _LOSSES.get(next(iter(options), ""), does if repairs else "fills the holes")
        other = ", or map it with `repair`" if path and not options else ""
        if fill:
            other = f", or {'without `fill_holes` ' * repairs}use an algorithm for surfaces with "
            other += "holes (see `cembench list algorithms`)"
        yield f"{repair_advice(path, {**options, **fill})} {does}{other}."
    if Remedy.cut in needed:
        call, also = "`cembench.cut(mesh)`", "`repair` and `cut`" if repairs or fill else "`cut`"
        if path:
            source = _named(path, "repaired_1" if "components" in options else "repaired")
            source = source if repairs or fill else shlex.quote(str(path))
            call = f"`cembench cut {source} -o {_named(path, 'cut')}`"
        yield f"{call} makes it a disk, or map it with {also}, for the UVs of the uncut surface."
    if Remedy.other_algorithm in needed:
        yield "Use an algorithm for disks (see `cembench list algorithms`)."


#: What a repair does that keeps the whole surface only with an option, by its name.
_LOSSES = {
    "components": "keeps every piece, each as a surface",
    "weld": "welds what lies apart by less than that",
    "drop": "drops what cannot be kept",
}


class RepairLossError(MeshError):
    """A repair would throw away part of a surface; `options` of :func:`cembench.repair` keep it.

    `kept` is what it would keep, `better` what it keeps with the options; these are empty where
    none keeps the whole surface.
    """

    def __init__(
        self,
        kept: object,
        options: Mapping[str, float | str],
        better: object = "",
        path: Path | None = None,
    ) -> None:
        self.kept, self.options, self.better, self.path = kept, dict(options), better, path
        super().__init__(kept, self.options, better, path)

    def __str__(self) -> str:
        where = f"{self.path}: " if self.path else ""
        way = ""
        if self.options:
            does = _LOSSES[next(iter(self.options))]
            way = f"{repair_advice(self.path, self.options)} {does}: {self.better}. "
        drop = repair_advice(self.path, {"drop": True})
        return f"{where}a repair would keep only {self.kept}. {way}{drop} allows the loss."


@contextmanager
def located(path: Path | None) -> Iterator[None]:
    """Name a surface's file, if there is one, in errors that are raised in this block."""
    try:
        yield
    except (UnusableMeshError, RepairLossError) as error:
        error.path = path or error.path
        raise
    except MeshError as error:
        raise (error if path is None else MeshError(f"{path}: {error}")) from None


def array_of(what: str, rows: ArrayLike, columns: int) -> NDArray[Any]:
    """Return rows of numbers as an array; an error names the first row of another length."""
    if np.ma.is_masked(rows):
        raise MeshError(
            f"the {what} are an array of which a mask hides numbers; allowed are arrays without a "
            "mask. Leave these rows out, or write .filled(value)."
        )
    try:
        return np.asarray(rows)
    except ValueError:
        pass
    lengths = [np.size(row) for row in cast("Sequence[ArrayLike]", rows)]
    row = next(k for k, length in enumerate(lengths) if length != columns)
    polygons = " Cut polygons into triangles first." if what == "faces" else ""
    raise MeshError(
        f"the {what} are a list of rows of different lengths: row {row} (counted from 0) has "
        f"{lengths[row]} numbers; allowed is {columns} in each.{polygons}"
    )


def check_finite(what: str, values: NDArray[Any]) -> None:
    """Raise :class:`MeshError` if values of vertices, one row each, are NaN or infinite."""
    bad = np.flatnonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))
    if len(bad):
        raise MeshError(
            f"{what} NaN or infinite at vertex {some(bad)} (counted from 0); all must be finite."
        )


def as_arrays(V: ArrayLike, F: ArrayLike) -> tuple[Points, Indices]:
    """Return vertices (n, 3) and triangles (m, 3) as float64 and int64.

    Raises
    ------
    MeshError
        The arrays have other shapes, the indices are not integers or count from 1, or there are no
        faces.
    """
    points, faces = array_of("vertices", V, 3), array_of("faces", F, 3)
    if points.dtype.kind in "iu" and faces.dtype.kind == "f" and faces.ndim == 2:
        raise MeshError(
            "the vertices are integers and the faces are not: the arrays are swapped, or the faces "
            "are not of an integer type. Write (V, F), the vertices first, or F.astype(int)."
        )
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"vertices have shape {points.shape}; allowed is (n, 3), a row per vertex.")
    if points.dtype.kind not in "fiub":
        raise MeshError(f"coordinates are of type {points.dtype}; allowed are real numbers.")
    if not len(points):
        raise MeshError("the mesh has no vertices; a surface needs at least three.")
    if faces.size == 0:
        raise MeshError(
            f"the mesh has {len(points)} vertices but no faces; a surface needs triangles. "
            "If this is a point cloud, reconstruct a surface from it first."
        )
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(
            f"faces have shape {faces.shape}; allowed is (m, 3), three vertex indices per triangle."
        )
    if not np.issubdtype(faces.dtype, np.integer):
        raise MeshError(f"face indices are of type {faces.dtype}; allowed are integers.")
    if faces.min() == 1 and faces.max() == len(points):
        raise MeshError(
            f"the faces count from 1: their indices are 1 to {len(points)}, as in MATLAB; allowed "
            f"are 0 to {len(points) - 1}. Write F - 1."
        )
    return np.array(points, dtype=np.float64), np.array(faces, dtype=np.int64)


class Examination(NamedTuple):
    """The result of examining triangles."""

    #: The triangles, oriented consistently in each connected piece.
    F: Indices
    #: What was changed, and which valid triangles are nearly degenerate.
    notices: tuple[Notice, ...]
    #: Every defect that keeps them from being a manifold; empty for a manifold.
    problems: tuple[Problem, ...]


def examine(V: Points, F: Indices, *, connected: bool) -> Examination:
    """Orient triangles, and find every defect that keeps them from being a manifold.

    With `connected` they must form a single piece too. For a valid surface only the quick checks
    run. For a surface with defects, coincident vertices and inconsistently oriented triangles are
    listed as well: they are allowed by themselves, but often the cause.
    """
    finite: Mask = np.asarray(np.isfinite(V).all(axis=1))
    inside: Mask = np.asarray(((F >= 0) & (len(V) > F)).all(axis=1))
    sound: Mask = inside & finite[np.where(inside[:, None], F, 0)].all(axis=1)
    number = np.flatnonzero(sound)
    valid = F if sound.all() else F[sound]
    scale = out_of_scale(V, valid)
    findings = [
        _problem(Defect.not_finite, np.flatnonzero(~finite)),
        _problem(Defect.out_of_range, np.flatnonzero(~inside), F, last=len(V) - 1),
        scale,
        _problem(Defect.isolated, np.flatnonzero(finite & ~marked(len(V), F[inside]))),
    ]
    turned = np.zeros(0, dtype=bool)
    if len(valid):
        facing, turned, contradictions = oriented(valid)
        areas = np.ones(0) if scale else relative_areas(V, valid)
        findings += [
            _problem(Defect.degenerate, number[np.flatnonzero(areas <= DEGENERATE_AREA)], F),
            *_edges(valid, contradictions),
            _vertices(facing, len(V), consistent=not len(contradictions)),
            components(valid, len(V)) if connected else None,
        ]
    problems = [p for p in findings if p is not None]
    if not problems:
        slivers = np.flatnonzero(areas <= SLIVER_AREA)
        return Examination(facing, _remarks(slivers, turned), ())
    if len(valid):
        one_sided = any(p.defect is Defect.one_sided for p in problems)
        more = [
            coincident(V),
            _problem(Defect.duplicate, number[duplicates(F[number])], F),
            None if one_sided else _problem(Defect.orientation, number[turned], F),
        ]
        problems += [p for p in more if p is not None]
    ordered = sorted(problems, key=lambda p: list(Defect).index(p.defect))
    return Examination(F, (), tuple(ordered))


def degenerate(V: Points, F: Indices) -> Mask:
    """Whether each triangle has no area, up to rounding."""
    return np.asarray(relative_areas(V, F) <= DEGENERATE_AREA)


def relative_areas(V: Points, F: Indices) -> Points:
    """Return each triangle's area over its longest edge squared; 0 where all corners coincide."""
    shares = np.zeros(len(F))
    for block, corners in _corners(V, F):
        (ax, bx, cx), (ay, by, cy), (az, bz, cz) = corners[:, [1, 2, 0]] - corners
        double_area = np.sqrt(
            (ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2
        )
        longest = np.maximum(
            np.maximum(ax**2 + ay**2 + az**2, bx**2 + by**2 + bz**2), cx**2 + cy**2 + cz**2
        )
        np.divide(double_area, 2 * longest, out=shares[block], where=longest > 0)
    return shares


def _corners(V: Points, F: Indices) -> Iterator[tuple[slice, Points]]:
    """Yield blocks of triangles (k), and their corners (3, 3, k): x, y, z of the three of each.

    No array of all corners is made.
    """
    coordinates = np.ascontiguousarray(V.T)
    for block in blocks(len(F)):
        yield block, coordinates.take(np.ascontiguousarray(F[block].T), axis=1)


def out_of_scale(V: Points, F: Indices) -> Problem | None:
    """Return the problem that products of lengths would overflow or underflow, or None."""
    finite = np.abs(V[np.isfinite(V).all(axis=1)])
    largest = finite.max(initial=0)
    if largest > LARGEST_LENGTH:
        text = f"a coordinate is {largest:.3g} in size; allowed is up to {LARGEST_LENGTH:g}"
        return Problem(Defect.scale, int((finite > LARGEST_LENGTH).any(axis=1).sum()), text)
    spans = np.empty(len(F))  # the largest side of each triangle's bounding box
    for block, corners in _corners(V, F):
        spans[block] = np.ptp(corners, axis=1).max(axis=0)
    tiny = np.flatnonzero((spans > 0) & (spans < SMALLEST_LENGTH))
    if not len(tiny):
        return None
    text = (
        f"triangle {some(tiny)} (counted from 0) spans less than {SMALLEST_LENGTH:g}, the first "
        f"{spans[tiny[0]]:.3g}"
    )
    return Problem(Defect.scale, len(tiny), text)


def duplicates(F: Indices) -> Mask:
    """Whether each triangle has the same three vertices as an earlier one."""
    alike = np.sort(F, axis=1)
    order = np.lexsort(alike.T)  # stable: the first of equal ones stays first
    return marked(len(F), order[1:][(alike[order[1:]] == alike[order[:-1]]).all(axis=1)])


def representatives(V: Points, tolerance: float = 0.0) -> Indices:
    """Return for each vertex the first vertex at its position, or within the tolerance of it.

    Vertices that are linked by steps within the tolerance count as one.
    """
    if tolerance == 0:
        _, first, place = np.unique(V + 0.0, axis=0, return_index=True, return_inverse=True)
        return first[place.reshape(-1)]
    from scipy.spatial import cKDTree

    i, j = cKDTree(V).query_pairs(tolerance, output_type="ndarray").T
    return topology.first_of_linked(i, j, len(V))


def oriented(F: Indices) -> tuple[Indices, Mask, Indices]:
    """Orient all triangles of each piece consistently, as most of them are.

    Returns
    -------
    F : int64 (m, 3)
        The triangles; reversed ones have two corners exchanged.
    turned : bool (m,)
        Whether a triangle was reversed.
    contradictions : int64 (k, 2)
        Directed edges that two triangles still share; empty unless the surface is one-sided or has
        non-manifold edges.
    """
    if not len(topology.repeated_half_edges(F)):
        return F, np.zeros(len(F), dtype=bool), np.empty((0, 2), dtype=np.int64)
    import igl  # imported here: every measured process would wait for it, and none needs it

    searched, piece = igl.bfs_orient(F)
    turned = (searched != F).any(axis=1)
    # The search keeps the orientation of its first triangle; keep the majority's instead.
    mostly = np.bincount(piece, weights=turned) > np.bincount(piece) / 2
    turned ^= mostly[piece]
    F = np.ascontiguousarray(np.where(turned[:, None], F[:, ::-1], F))
    return F, turned, topology.repeated_half_edges(F)


def coincident(V: Points) -> Problem | None:
    """Return the problem that vertices coincide exactly, or None."""
    finite = np.flatnonzero(np.isfinite(V).all(axis=1))
    same = representatives(V[finite])
    extra = np.flatnonzero(same != np.arange(len(same)))
    if not len(extra):
        return None
    i, j = finite[same[extra[0]]], finite[extra[0]]
    text = (
        f"coincident vertices: {len(extra)} vertices have exactly the position of another vertex, "
        f"the first pair being {i} and {j} (counted from 0); there may be open seams that should "
        "be closed"
    )
    return Problem(Defect.coincident, len(extra), text)


def components(F: Indices, n: int) -> Problem | None:
    """Return the problem that triangles form several connected pieces, or None."""
    _, label = topology.components(F, n)
    vertices = np.bincount(label, weights=marked(n, F)).astype(int)
    pieces = np.flatnonzero(vertices)
    if len(pieces) == 1:
        return None
    ends = (vertices.argmax(), pieces[::-1][vertices[pieces[::-1]].argmin()])  # of equal ones, too
    large, small = (np.flatnonzero((label == end) & marked(n, F))[0] for end in ends)
    text = (
        f"the mesh has {len(pieces)} connected components (vertex {large} lies in the largest, "
        f"with {vertices.max()} of {vertices.sum()} vertices, vertex {small} in the smallest); "
        "this needs exactly one"
    )
    return Problem(Defect.components, len(pieces), text)


def some(indices: Indices, most: int = 5) -> str:
    """Format the first few of many indices for a message."""
    shown = ", ".join(str(k) for k in indices[:most].tolist())
    return shown + (f", ... ({len(indices)} in all)" if len(indices) > most else "")


def _remarks(thin: Indices, turned: Mask) -> tuple[Notice, ...]:
    """Return notices of slivers, and of triangles that were reversed, if there are any."""
    texts = {}
    if len(thin):
        texts[NoticeKind.SLIVERS] = (
            f"slivers, with less area than {SLIVER_AREA:g} of their longest edge squared: triangle "
            f"{some(thin)}; energies and dilatations lose digits in rounding there"
        )
    if turned.any():
        count = f"{turned.sum()} of {len(turned)} triangles were turned over"
        texts[NoticeKind.ORIENTATION_REPAIRED] = f"orientation repaired: {count}"
    return tuple(Notice(kind, text) for kind, text in texts.items())


#: What is wrong, by defect, where a list of vertices or triangles says all: `some` are the first of
#: them, `first` the vertices of the first triangle.
_TEXTS = {
    Defect.not_finite: (
        "coordinates that are NaN or infinite at vertex {some} (counted from 0); all must be finite"
    ),
    Defect.out_of_range: (
        "triangle {some} (counted from 0) has a vertex index out of range, the first being "
        "{first}; allowed is 0 to {last}: the file is damaged or was cut short"
    ),
    Defect.isolated: "isolated vertices, in no triangle: {some} (counted from 0)",
    Defect.degenerate: (
        "degenerate triangles (zero area): {some} (counted from 0), the first with vertices "
        "{first}; their angles are undefined"
    ),
    Defect.duplicate: (
        "duplicate triangles, with the same three vertices as another: {some} (counted from 0), "
        "the first with vertices {first}"
    ),
    Defect.orientation: (
        "inconsistent orientation: {count} triangle(s) have the opposite orientation to the rest, "
        "the first with vertices {first}"
    ),
    Defect.vertices: (
        "non-manifold vertex {some} (counted from 0): its triangles form more than one fan, so "
        "the surface touches itself at a point"
    ),
}


def _problem(
    defect: Defect, bad: Indices, F: Indices | None = None, last: int = 0
) -> Problem | None:
    """Return the problem that these vertices, or triangles of F, have a defect; None for none."""
    if not len(bad):
        return None
    first = [] if F is None else F[bad[0]].tolist()
    text = _TEXTS[defect].format(some=some(bad), first=first, count=len(bad), last=last)
    return Problem(defect, len(bad), text)


def _edges(F: Indices, contradictions: Indices) -> list[Problem]:
    """Return the problem that edges have more than two triangles, or that a surface is one-sided.

    Where no contradiction of orientations is left, edges have at most two triangles.
    """
    if not len(contradictions):
        return []
    edges, faces = topology.undirected_edges(F)
    bad = np.flatnonzero(faces > 2)
    if len(bad):
        i, j = edges[bad[0]].tolist()
        message = (
            f"non-manifold edge: {len(bad)} edge(s) have more than two triangles, the first being "
            f"{i}-{j} with {faces[bad[0]]}"
        )
        return [Problem(Defect.edges, len(bad), message)]
    i, j = contradictions[0].tolist()
    closed = (faces == 2).all()
    kind = "closed and one-sided (like a Klein bottle)" if closed else "one-sided (like a Moebius"
    message = (
        f"the surface is {kind}{'' if closed else ' strip)'}: the triangles at edge {i}-{j} cannot "
        "be oriented consistently; a repair cuts the surface there"
    )
    return [Problem(Defect.one_sided, len(contradictions), message)]


def _vertices(F: Indices, n: int, *, consistent: bool) -> Problem | None:
    """Return the problem that triangles at a vertex form several fans, or None.

    Edges with more than two triangles, or orientations that contradict each other, take libigl's
    general and slower test.
    """
    distinct = (np.roll(F, 1, axis=1) != F).all(axis=1)
    # Triangles with one or two vertices are another defect.
    proper = F if distinct.all() else F[distinct]
    if not len(proper):
        return None
    if consistent:
        bad = vertices_of_several_fans(proper, n)
    else:
        import igl

        manifold = igl.is_vertex_manifold(proper)  # also false for vertices in no triangle
        bad = np.flatnonzero(~manifold & marked(len(manifold), proper))
    return _problem(Defect.vertices, bad)
