"""Meshes that have passed every check, so that no algorithm has to check again.

:class:`TriangleMesh` is an oriented 2-manifold without isolated vertices or degenerate triangles;
:class:`DiskMesh` and :class:`HoledMesh` add the topology. All are frozen, arrays included.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csgraph

from cembench.core.clock import phase
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import printable
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology

#: A triangle counts as degenerate when its area is below this share of its longest edge squared.
DEGENERATE_AREA = 1e-15
#: Below this share a triangle is kept, with a notice: cotangents lose digits with its square.
SLIVER_AREA = 1e-6
#: Coordinates and edges in between: the fourth powers of lengths are computed with.
LARGEST_LENGTH = 1e60
SMALLEST_LENGTH = 1e-60


@dataclass(frozen=True, eq=False, init=False)
class TriangleMesh:
    """An oriented 2-manifold triangulation in space.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices; read-only.
    F : int64 (m, 3)
        Triangles, counter-clockwise seen from outside; read-only.
    name : str
        What reports call it.
    notices : tuple of Notice
        What was changed on the way in, and which premises of the paper the mesh breaks.

    """

    V: NDArray[np.float64]
    F: NDArray[np.int64]
    name: str = "mesh"
    notices: tuple[Notice, ...] = ()

    def __init__(
        self, V: ArrayLike, F: ArrayLike, name: str = "mesh", notices: tuple[Notice, ...] = ()
    ) -> None:
        """Check everything, orient where needed, freeze.

        Raises
        ------
        MeshError
            Arrays of the wrong shape or type, NaN or infinite coordinates, an index out of range,
            isolated vertices, degenerate triangles, non-manifold edges or vertices, a surface that
            cannot be oriented; for the subclasses also the wrong topology.

        """
        V, F = _as_arrays(V, F)
        notices += _check_values(V, F)
        _check_edges(F)
        F, flipped = _oriented(F)
        if flipped:
            told = f"orientation repaired: {flipped} of {len(F)} triangles were turned over"
            notices += (Notice(NoticeKind.ORIENTATION_REPAIRED, told),)
        _check_vertex_stars(F)
        notices += self._check_topology(V, F)
        V.setflags(write=False)
        F.setflags(write=False)
        self._set(V, F, printable(name), notices)

    def _set(
        self, V: NDArray[np.float64], F: NDArray[np.int64], name: str, notices: tuple[Notice, ...]
    ) -> None:
        for field, value in (("V", V), ("F", F), ("name", name), ("notices", notices)):
            object.__setattr__(self, field, value)

    @classmethod
    def from_arrays(
        cls, V: ArrayLike, F: ArrayLike, *, name: str = "mesh", notices: tuple[Notice, ...] = ()
    ) -> Self:
        """Return the checked mesh of these arrays; the same as calling the class."""
        return cls(V, F, name, notices)

    @classmethod
    def trusted(
        cls,
        V: NDArray[np.float64],
        F: NDArray[np.int64],
        name: str = "mesh",
        notices: tuple[Notice, ...] = (),
    ) -> Self:
        """Return a mesh of arrays that were checked before, and check nothing."""
        mesh = cls.__new__(cls)
        mesh._set(V, F, name, notices)
        return mesh

    def renamed(self, name: str) -> Self:
        """Return the same mesh under another name."""
        return self.trusted(self.V, self.F, printable(name), self.notices)

    def moved(self, V: NDArray[np.float64]) -> Self:
        """Return the same triangles with vertices at other places (n, 3)."""
        return self.trusted(V, self.F, self.name, self.notices)

    @classmethod
    def _check_topology(cls, V: NDArray[np.float64], F: NDArray[np.int64]) -> tuple[Notice, ...]:
        """Raise where the surface is not of this class; return what the user should know."""
        return ()

    def fresh(self) -> Self:
        """The same mesh, nothing derived from it yet: what a timed call starts from."""
        return self.trusted(self.V, self.F, self.name, self.notices)

    @property
    def n(self) -> int:
        """Number of vertices."""
        return len(self.V)

    @property
    def m(self) -> int:
        """Number of triangles."""
        return len(self.F)

    @cached_property
    def loops(self) -> tuple[NDArray[np.int64], ...]:
        """Boundary loops, each in order with the surface on its left."""
        with phase("boundary"):
            return tuple(topology.boundary_loops(self.F, self.n))

    @cached_property
    def interior(self) -> NDArray[np.int64]:
        """Indices i of the vertices on no boundary loop, ascending."""
        inside = np.ones(self.n, dtype=bool)
        for loop in self.loops:
            inside[loop] = False
        return np.flatnonzero(inside)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the coordinates and the triangles: the same mesh has the same hash."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.V, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.F, dtype="<i8").tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False, init=False)
class DiskMesh(TriangleMesh):
    """A simply-connected open surface: connected, one boundary loop, Euler characteristic 1."""

    @property
    def boundary(self) -> NDArray[np.int64]:
        """Indices b of the boundary vertices in order, counter-clockwise (surface on the left)."""
        return self.loops[0]

    @classmethod
    def _check_topology(cls, V: NDArray[np.float64], F: NDArray[np.int64]) -> tuple[Notice, ...]:
        loops = _loops_of_connected_open_surface(F, len(V))
        if len(loops) > 1:
            sizes = ", ".join(str(len(loop)) for loop in sorted(loops, key=len, reverse=True)[:5])
            raise MeshError(
                f"the surface has {len(loops)} boundary loops (of {sizes}"
                f"{', ...' if len(loops) > 5 else ''} vertices); this needs a topological disk, "
                "with exactly one. Fill the holes, or use an algorithm for surfaces with holes "
                "(see `cembench list algorithms`)."
            )
        _check_genus(F, len(V), 1)
        return definition_1_notices(F, len(V), loops)


@dataclass(frozen=True, eq=False, init=False)
class HoledMesh(TriangleMesh):
    """A multiply-connected surface of genus zero: an outer boundary and at least one hole."""

    def outer_and_holes(
        self, outer: int | None = None
    ) -> tuple[NDArray[np.int64], tuple[NDArray[np.int64], ...]]:
        """Return the outer boundary loop, and the holes.

        The outer one is that of the vertex `outer`, or the widest, by the mean square distance of
        its points from their centroid: a hole with many fingers can be longer than the boundary
        round it. The holes come longest first.
        Each has the surface on its left, so the outer one runs counter-clockwise in a map.

        Raises
        ------
        ParameterError
            There is no such vertex, or it lies on no boundary loop.

        """
        lengths = [
            np.linalg.norm(np.roll(self.V[loop], -1, axis=0) - self.V[loop], axis=1).sum()
            for loop in self.loops
        ]
        loops = [self.loops[k] for k in np.argsort(lengths, kind="stable")[::-1]]
        if outer is None:
            widest = int(np.argmax([_width(self.V[loop]) for loop in loops]))
            return loops.pop(widest), tuple(loops)
        chosen = [k for k, loop in enumerate(loops) if (loop == outer).any()]
        if not chosen:
            where = "is no vertex" if not 0 <= outer < self.n else "lies on no boundary loop"
            shown = ", ".join(f"{loop[0]} ({len(loop)} vertices)" for loop in loops[:5])
            raise ParameterError(
                f"outer={outer}: vertex {outer} (counted from 0) {where} of {self.name}, so it "
                "names no outer boundary. Name any vertex of the loop; the longest loops have for "
                f"example: {shown}."
            )
        return loops.pop(chosen[0]), tuple(loops)

    @classmethod
    def _check_topology(cls, V: NDArray[np.float64], F: NDArray[np.int64]) -> tuple[Notice, ...]:
        loops = _loops_of_connected_open_surface(F, len(V))
        if len(loops) == 1:
            raise MeshError(
                "the surface has a single boundary loop; this needs an outer boundary and at least "
                "one hole. Use an algorithm for disks (see `cembench list algorithms`)."
            )
        _check_genus(F, len(V), len(loops))
        return definition_1_notices(F, len(V), loops)


def _width(loop: NDArray[np.float64]) -> float:
    """Return the mean square distance of a closed polygon's points (k, 3) from their centroid."""
    after, middle = np.roll(loop, -1, axis=0), (loop + np.roll(loop, -1, axis=0)) / 2
    lengths = np.linalg.norm(after - loop, axis=1)
    away = middle - np.average(middle, axis=0, weights=lengths)
    return float(np.average((away**2).sum(axis=1), weights=lengths))


def _as_arrays(V: ArrayLike, F: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    points, faces = np.asarray(V), np.asarray(F)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"vertices have shape {points.shape}; allowed is (n, 3), one row a vertex.")
    if faces.size == 0:
        raise MeshError(
            f"the mesh has {len(points)} vertices but no faces; a surface needs triangles. "
            "If this is a point cloud, reconstruct a surface from it first."
        )
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(
            f"faces have shape {faces.shape}; allowed is (m, 3), three vertex indices a triangle."
        )
    if not np.issubdtype(faces.dtype, np.integer):
        raise MeshError(f"face indices are of type {faces.dtype}; allowed are integers.")
    return np.array(points, dtype=np.float64), np.array(faces, dtype=np.int64)


def _some(indices: NDArray[np.int64], most: int = 5) -> str:
    """The first few of many, for a message."""
    shown = ", ".join(str(k) for k in indices[:most].tolist())
    return shown + (f", ... ({len(indices)} in all)" if len(indices) > most else "")


def _check_values(V: NDArray[np.float64], F: NDArray[np.int64]) -> tuple[Notice, ...]:
    """Raise for coordinates or indices that are no triangles; a notice of those hardly any."""
    bad = np.flatnonzero(~np.isfinite(V).all(axis=1))
    if len(bad):
        raise MeshError(
            f"coordinates that are NaN or infinite at vertex {_some(bad)} (counted from 0); "
            "all must be finite. Repair or remove these vertices."
        )
    bad = np.flatnonzero(((F < 0) | (len(V) <= F)).any(axis=1))
    if len(bad):
        raise MeshError(
            f"triangle {_some(bad)} (counted from 0) has a vertex index out of range, the first "
            f"being {F[bad[0]].tolist()}; allowed is 0 to {len(V) - 1}. "
            "The file is damaged or was cut short."
        )
    used = np.zeros(len(V), dtype=bool)
    used[F] = True
    bad = np.flatnonzero(~used)
    if len(bad):
        raise MeshError(
            f"isolated vertices, in no triangle: {_some(bad)} (counted from 0). "
            "Remove unreferenced vertices and save again."
        )
    _check_scale(V, F)
    corners = V[F]
    edges = corners[:, [1, 2, 0]] - corners
    double_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    longest = (edges**2).sum(axis=2).max(axis=1)
    bad = np.flatnonzero(double_area <= 2 * DEGENERATE_AREA * longest)
    if len(bad):
        raise MeshError(
            f"degenerate triangles (zero area): {_some(bad)} (counted from 0), the first with "
            f"vertices {F[bad[0]].tolist()}. Angles are not defined there; merge duplicate "
            "vertices or collapse these triangles."
        )
    thin = np.flatnonzero(double_area <= 2 * SLIVER_AREA * longest)
    if not len(thin):
        return ()
    told = (
        f"slivers, with less area than {SLIVER_AREA:g} of their longest edge squared: triangle "
        f"{_some(thin)}; energies and dilatations lose digits in rounding there"
    )
    return (Notice(NoticeKind.SLIVERS, told),)


def _check_scale(V: NDArray[np.float64], F: NDArray[np.int64]) -> None:
    """Raise where products of lengths would overflow or vanish, whatever the surface's shape."""
    advice = "Angles do not depend on the scale: divide all coordinates by the same number."
    largest = np.abs(V).max()
    if largest > LARGEST_LENGTH:
        raise MeshError(
            f"a coordinate is {largest:.3g} in size; allowed is up to {LARGEST_LENGTH:g}. {advice}"
        )
    spans = np.abs(V[F[:, [1, 2, 0]]] - V[F]).max(axis=(1, 2))
    tiny = np.flatnonzero((spans > 0) & (spans < SMALLEST_LENGTH))
    if len(tiny):
        raise MeshError(
            f"triangle {_some(tiny)} (counted from 0) spans less than {SMALLEST_LENGTH:g}, the "
            f"first {spans[tiny[0]]:.3g}. {advice}"
        )


def _check_edges(F: NDArray[np.int64]) -> None:
    edges, faces = topology.undirected_edges(F)
    bad = np.flatnonzero(faces > 2)
    if len(bad):
        i, j = edges[bad[0]].tolist()
        raise MeshError(
            f"non-manifold edge: {len(bad)} edge(s) have more than two triangles, the first being "
            f"{i}-{j} with {faces[bad[0]]}. Delete the surplus triangles or cut the surface there."
        )


def _oriented(F: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Orient all triangles alike, as most of them are; how many had to be turned over?"""
    if not len(topology.repeated_half_edges(F)):
        return F, 0
    import igl  # here and below: every measured process would wait for it, and none needs it

    turned, piece = igl.bfs_orient(F)
    flipped = (turned != F).any(axis=1)
    # The search keeps the first triangle it meets; keep the majority instead, piece by piece.
    mostly = np.bincount(piece, weights=flipped) > np.bincount(piece) / 2
    flipped ^= mostly[piece]
    F = np.where(flipped[:, None], F[:, ::-1], F)
    bad = topology.repeated_half_edges(F)
    if len(bad):
        i, j = bad[0].tolist()
        raise MeshError(
            "inconsistent orientation that cannot be repaired: the surface is one-sided (like a "
            f"Moebius strip); the triangles at edge {i}-{j} contradict each other however they "
            "are turned. Cut the surface along a curve that makes it two-sided."
        )
    return np.ascontiguousarray(F), int(flipped.sum())


def _check_vertex_stars(F: NDArray[np.int64]) -> None:
    import igl

    bad = np.flatnonzero(~igl.is_vertex_manifold(F))
    if len(bad):
        raise MeshError(
            f"non-manifold vertex {_some(bad)} (counted from 0): its triangles form more than one "
            "fan, so the surface touches itself in a point. Split the vertex, one copy a fan."
        )


def _loops_of_connected_open_surface(F: NDArray[np.int64], n: int) -> list[NDArray[np.int64]]:
    count, labels = topology.components(F, n)
    if count > 1:
        sizes = np.bincount(labels)
        raise MeshError(
            f"the mesh has {count} connected components (the largest with {sizes.max()} of {n} "
            f"vertices; vertex {int(np.argmin(sizes[labels]))} lies in the smallest); this needs "
            "exactly one. Keep one component and save it alone."
        )
    loops = topology.boundary_loops(F, n)
    if not loops:
        raise MeshError(
            "the surface is closed: it has no boundary loop, and a map to the disk needs one. "
            "Cut it open, or remove a patch of triangles."
        )
    return loops


def _check_genus(F: NDArray[np.int64], n: int, loops: int) -> None:
    euler = topology.euler_characteristic(F, n)
    genus = (2 - loops - euler) // 2
    if genus:
        raise MeshError(
            f"the surface has genus {genus} (Euler characteristic {euler} with {loops} boundary "
            f"loop(s); allowed is {2 - loops}, genus 0): it has {genus} handle(s) like a torus. "
            "Cut each handle open, or remove it."
        )


def definition_1_notices(
    F: NDArray[np.int64], n: int, loops: Sequence[NDArray[np.int64]]
) -> tuple[Notice, ...]:
    """Return where the mesh breaks the paper's Definition 1 (a well-conditioned mesh)."""
    broken = _breaks_of_definition_1(F, n, loops)
    return tuple(Notice(NoticeKind.DEFINITION_1, f"Definition 1 {where}") for where in broken)


def _breaks_of_definition_1(
    F: NDArray[np.int64], n: int, loops: Sequence[NDArray[np.int64]]
) -> Iterator[str]:
    inside = np.ones(n, dtype=bool)
    inside[np.concatenate(loops)] = False
    graph = topology.vertex_graph(F, n)
    if not inside.any():
        yield "(ii), (iv) broken: the mesh has no interior vertex"
        return
    interior = np.flatnonzero(inside)
    pieces, _ = csgraph.connected_components(graph[interior][:, interior], directed=False)
    if pieces > 1:
        yield f"(ii) broken: the interior vertices form {pieces} pieces, not one"
    for loop in loops:
        ears = loop[graph[loop][:, interior].sum(axis=1) == 0]
        if len(ears) and len(loops) == 1:
            yield f"(iv) broken: boundary vertices without an interior neighbour: {_some(ears)}"
        elif len(ears):
            yield (
                f"(iv) broken: on the boundary of vertex {loop.min()} ({len(loop)} "
                f"vertices), vertices without an interior neighbour: {_some(ears)}. If this is a "
                "hole, their triangles fold in every map to a disk with round holes: a triangle "
                "with all corners on a circle lies inside it. Remove these vertices, or divide "
                "their triangles"
            )
