"""Meshes that have passed every check, so that algorithms need no checks of their own.

:class:`TriangleMesh` is an oriented 2-manifold without isolated vertices or degenerate triangles;
:class:`DiskMesh` and :class:`HoledMesh` add conditions on the topology. All are immutable, arrays
included.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy
from numpy.typing import ArrayLike

from cembench.core.arrays import Indices, Real, marked
from cembench.core.clock import phase
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import printable
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh import topology
from cembench.mesh.defects import (
    Defect,
    Problem,
    Remedy,
    RepairLossError,
    UnusableMeshError,
    as_arrays,
    check_finite,
    coincident,
    examine,
    some,
)
from cembench.mesh.plausibility import implausible
from cembench.mesh.repair import repair
from cembench.mesh.side_lengths import loop_width

#: Boundary loops, each as its vertices in order.
Loops = Sequence[Indices]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class TriangleMesh:
    """An oriented 2-manifold triangulation in space.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices; read-only.
    F : int64 (m, 3)
        Triangles, counter-clockwise seen from outside; read-only.
    name : str
        Name in reports.
    notices : tuple of Notice
        What was changed when the mesh was read, and which premises of the paper it breaks.

    Raises
    ------
    UnusableMeshError
        The arrays are not such a surface; the error lists all problems.
    MeshError
        The arrays have the wrong shape or type.

    Examples
    --------
    >>> import cembench
    >>> V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> tetrahedron = cembench.TriangleMesh(V, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> tetrahedron, len(tetrahedron.loops)
    (<TriangleMesh mesh: 4 vertices, 4 triangles>, 0)
    """

    V: Real
    F: Indices
    name: str = "mesh"
    notices: tuple[Notice, ...] = ()

    def __init__(
        self, V: ArrayLike, F: ArrayLike, name: str = "mesh", notices: tuple[Notice, ...] = ()
    ) -> None:
        """Check everything, orient the triangles if needed, and make the arrays read-only.

        Raises
        ------
        UnusableMeshError
            NaN or infinite coordinates, an index out of range, isolated vertices, degenerate
            triangles, non-manifold edges or vertices, a one-sided surface; for the subclasses also
            the wrong topology. The error lists all of these problems.
        MeshError
            The arrays have the wrong shape or type.
        """
        kind = type(self)
        V, F = as_arrays(V, F)
        F, remarks, problems = examine(V, F, connected=kind is not TriangleMesh)
        if problems:
            more, options = _when_repaired(kind, V, F, problems)
            wrong = implausible(V, F, sheets=False)
            raise UnusableMeshError([*problems, *more], options=options, notices=wrong)
        loops = topology.boundary_loops(F, len(V))
        try:
            notices += remarks + kind._check_topology(V, F, loops)
        except UnusableMeshError as error:
            open_seams = coincident(V)
            raise UnusableMeshError(
                [*([open_seams] if open_seams else []), *error.problems]
            ) from None
        V.setflags(write=False)
        F.setflags(write=False)
        self._set(V, F, printable(name), notices)
        self.__dict__["loops"] = tuple(loops)

    def _set(self, V: Real, F: Indices, name: str, notices: tuple[Notice, ...]) -> None:
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
        cls, V: Real, F: Indices, name: str = "mesh", notices: tuple[Notice, ...] = ()
    ) -> Self:
        """Return a mesh of arrays that were checked before, without checking them."""
        mesh = cls.__new__(cls)
        mesh._set(V, F, name, notices)
        return mesh

    def renamed(self, name: str) -> Self:
        """Return the same mesh under another name."""
        return self.trusted(self.V, self.F, printable(name), self.notices)

    def noted(self, notices: tuple[Notice, ...]) -> Self:
        """Return the same mesh with more notices."""
        if not notices:
            return self
        mesh = self.trusted(self.V, self.F, self.name, (*self.notices, *notices))
        mesh.__dict__["loops"] = self.loops
        return mesh

    def moved(self, V: ArrayLike) -> Self:
        """Return the same triangles with other vertex positions, finite and real (n, 3)."""
        V, _ = as_arrays(V, self.F)
        if len(V) != self.n:
            raise MeshError(f"{len(V)} positions for {self.n} vertices; allowed is one each.")
        check_finite("positions are", V)
        V.setflags(write=False)
        return self.trusted(V, self.F, self.name, self.notices)

    @classmethod
    def _check_topology(cls, V: Real, F: Indices, loops: Loops) -> tuple[Notice, ...]:
        """Raise if the surface is not of this class; return notices for the user."""
        return ()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}: {self.n:,} vertices, {self.m:,} triangles>"

    def fresh(self) -> Self:
        """Return the mesh without anything derived from it, as a timed call receives it."""
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
    def loops(self) -> tuple[Indices, ...]:
        """Boundary loops, each in order with the surface on its left."""
        with phase("boundary"):
            return tuple(topology.boundary_loops(self.F, self.n))

    @cached_property
    def interior(self) -> Indices:
        """Indices i of the vertices on no boundary loop, ascending."""
        none = self.F[:0, 0]  # a closed surface has no loops
        return np.flatnonzero(~marked(self.n, np.concatenate([none, *self.loops])))

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the coordinates and the triangles; equal meshes have equal hashes."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.V, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.F, dtype="<i8").tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False, init=False, repr=False)
class DiskMesh(TriangleMesh):
    """A simply connected surface with boundary: one boundary loop, Euler characteristic 1.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices; read-only.
    F : int64 (m, 3)
        Triangles, counter-clockwise seen from outside; read-only.
    name : str
        Name in reports.
    notices : tuple of Notice
        What was changed when the mesh was read, and which premises of the paper it breaks.

    Raises
    ------
    UnusableMeshError
        The surface is not a disk, or not a manifold; the error lists all problems.
    MeshError
        The arrays have the wrong shape or type.

    Examples
    --------
    >>> import cembench
    >>> V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> square = cembench.DiskMesh(V, [[0, 1, 2], [0, 2, 3]])
    >>> square.boundary
    array([0, 1, 2, 3])
    """

    @property
    def boundary(self) -> Indices:
        """Indices of the boundary vertices in order, counter-clockwise (surface on the left)."""
        return self.loops[0]

    @classmethod
    def _check_topology(cls, V: Real, F: Indices, loops: Loops) -> tuple[Notice, ...]:
        return _check_planar(F, len(V), loops, [_holes(V, loops)] if len(loops) > 1 else [])


@dataclass(frozen=True, eq=False, init=False, repr=False)
class HoledMesh(TriangleMesh):
    """A multiply connected surface of genus zero: an outer boundary and at least one hole.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices; read-only.
    F : int64 (m, 3)
        Triangles, counter-clockwise seen from outside; read-only.
    name : str
        Name in reports.
    notices : tuple of Notice
        What was changed when the mesh was read, and which premises of the paper it breaks.

    Raises
    ------
    UnusableMeshError
        The surface has fewer than two boundary loops or a handle, or is not a manifold; the error
        lists all problems.
    MeshError
        The arrays have the wrong shape or type.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> outer, holes = ring.outer_and_holes()
    >>> len(holes)
    1
    """

    def outer_and_holes(self, outer: int | None = None) -> tuple[Indices, tuple[Indices, ...]]:
        """Return the outer boundary loop, and the holes.

        The outer loop is that of the vertex `outer`, or the widest by the mean square distance of
        its points from their centroid, since a hole with many fingers can be longer than the
        boundary around it. The holes are sorted by length, longest first. Each loop has the surface
        on its left, so the outer one runs counter-clockwise in a map.

        Parameters
        ----------
        outer : int, optional
            Any vertex of the outer boundary, counted from 0 (default: that of the widest loop).

        Returns
        -------
        outer : int64 (k,)
            The vertices of the outer boundary in order.
        holes : tuple of int64 arrays
            The vertices of each hole in order.

        Raises
        ------
        ParameterError
            There is no such vertex, or it is not on a boundary loop.
        """
        lengths = [
            np.linalg.norm(np.roll(self.V[loop], -1, axis=0) - self.V[loop], axis=1).sum()
            for loop in self.loops
        ]
        loops = [self.loops[k] for k in np.argsort(lengths, kind="stable")[::-1]]
        if outer is None:
            widest = int(np.argmax([loop_width(self.V[loop]) for loop in loops]))
            return loops.pop(widest), tuple(loops)
        chosen = [k for k, loop in enumerate(loops) if (loop == outer).any()]
        if not chosen:
            where = "is not a vertex" if not 0 <= outer < self.n else "lies on no boundary loop"
            shown = ", ".join(f"{loop[0]} ({len(loop)} vertices)" for loop in loops[:5])
            raise ParameterError(
                f"outer={outer}: vertex {outer} (counted from 0) {where} of {self.name}, so it "
                f"cannot identify the outer boundary. Name any vertex of that loop; vertices of "
                f"the longest loops are: {shown}."
            )
        return loops.pop(chosen[0]), tuple(loops)

    @classmethod
    def _check_topology(cls, V: Real, F: Indices, loops: Loops) -> tuple[Notice, ...]:
        text = (
            "the surface has a single boundary loop; this needs an outer boundary and at least one "
            "hole"
        )
        wrong = [Problem(Defect.no_hole, 1, text)] if len(loops) == 1 else []
        return _check_planar(F, len(V), loops, wrong)


def _when_repaired(
    kind: type[TriangleMesh], V: Real, F: Indices, known: tuple[Problem, ...]
) -> tuple[tuple[Problem, ...], dict[str, Any]]:
    """Return the problems that would keep the surface from its class after a repair.

    Also the options with which a repair keeps the whole surface.
    """
    if any(problem.remedy is Remedy.rescale for problem in known):
        return (), {}
    options: dict[str, Any] = {}
    try:
        repaired = repair(V, F)
    except RepairLossError as error:
        options = error.options or {"drop": True}
        repaired = repair(V, F, **options)
    except MeshError:  # nothing would be left of it, so only its own defects are reported
        return (), {}
    V, F = repaired.surfaces[0]
    try:
        kind._check_topology(V, F, topology.boundary_loops(F, len(V)))
    except UnusableMeshError as error:
        one_sided = any(problem.defect is Defect.one_sided for problem in known)
        return tuple(_of_cut(one) if one_sided else one for one in error.problems), options
    return (), options


def _of_cut(problem: Problem) -> Problem:
    """Return a problem that a one-sided surface has once it is cut; another cut removes it."""
    return replace(problem, text=f"once it is cut, {problem.text}", other_remedy=Remedy.cut)


def _check_planar(F: Indices, n: int, loops: Loops, problems: list[Problem]) -> tuple[Notice, ...]:
    """Raise if there are problems, no boundary loop, or handles; return notices for the user."""
    if not loops:
        text = "the surface is closed: it has no boundary loop, and a map to the disk needs one"
        problems = [Problem(Defect.closed, 1, text)]
    problems = [*problems, *_handles(F, n, loops)]
    if problems:
        raise UnusableMeshError(problems)
    return definition_1_notices(F, n, loops)


def _holes(V: Real, loops: Loops) -> Problem:
    """Return the problem that a surface has several boundary loops."""
    sizes = sorted(map(len, loops), reverse=True)
    lengths = [np.linalg.norm(V[loop] - V[np.roll(loop, 1)], axis=1).sum() for loop in loops]
    longest = int(np.argmax(lengths))
    edges = max(len(loop) for k, loop in enumerate(loops) if k != longest)
    text = (
        f"the surface has {len(loops)} boundary loops (of {', '.join(map(str, sizes[:5]))}"
        f"{', ...' if len(loops) > 5 else ''} vertices); this needs a topological disk, with "
        "exactly one"
    )
    return Problem(Defect.holes, len(loops) - 1, text, edges)


def _handles(F: Indices, n: int, loops: Loops) -> list[Problem]:
    """Return the problem that a surface has handles, if it has."""
    genus = topology.genus(F, n, loops)
    if not genus:
        return []
    count = len(loops)
    text = (
        f"the surface has genus {genus} (Euler characteristic {2 - 2 * genus - count} with {count} "
        f"boundary loop(s); allowed is {2 - count}, genus 0): it has {genus} handle(s) like a torus"
    )
    return [Problem(Defect.handles, genus, text)]


def definition_1_notices(F: Indices, n: int, loops: Loops) -> tuple[Notice, ...]:
    """Return notices on where the mesh breaks the paper's Definition 1 (well-conditioned)."""
    broken = _breaks_of_definition_1(F, n, loops)
    return tuple(Notice(NoticeKind.DEFINITION_1, f"Definition 1 {where}") for where in broken)


def _breaks_of_definition_1(F: Indices, n: int, loops: Loops) -> Iterator[str]:
    """Yield a text for each condition of Definition 1 that the mesh breaks."""
    inside = ~marked(n, np.concatenate(loops))
    if not inside.any():
        yield "(ii), (iv) broken: the mesh has no interior vertex"
        return
    boundary = ~inside
    both_ends = sum(
        np.count_nonzero(boundary[F[:, c]] & boundary[F[:, (c + 1) % 3]]) for c in range(3)
    )
    if both_ends == np.count_nonzero(boundary):
        # No edge but those of the boundary joins two boundary vertices. So triangles with a common
        # edge have interior vertices that are the same or neighbours: all of them form one piece;
        # and a boundary vertex without an interior neighbour would have such an edge.
        return
    graph = topology.vertex_graph(F, n)
    interior = np.flatnonzero(inside)
    pieces, _ = scipy.sparse.csgraph.connected_components(
        graph[interior][:, interior], directed=False
    )
    if pieces > 1:
        yield f"(ii) broken: the interior vertices form {pieces} pieces, not one"
    for loop in loops:
        ears = loop[graph[loop][:, interior].sum(axis=1) == 0]
        if len(ears) and len(loops) == 1:
            yield f"(iv) broken: boundary vertices without an interior neighbour: {some(ears)}"
        elif len(ears):
            yield (
                f"(iv) broken: on the boundary of vertex {loop.min()} ({len(loop)} vertices), "
                f"vertices without an interior neighbour: {some(ears)}. If this is a hole, their "
                "triangles fold in every map to a disk with round holes: a triangle with all "
                "corners on a circle lies inside it. Remove these vertices, or divide their "
                "triangles"
            )
