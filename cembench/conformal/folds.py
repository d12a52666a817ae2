"""Folded triangles in a map to the disk, and their local repair.

The boundary stays where the method put it, except for vertices that changed places. Then patches of
the interior around the folds are laid out again (:mod:`cembench.conformal.untangling`), with
everything else fixed. What cannot be repaired that way stays folded: a map that is made free of
folds at the expense of its angles is useless.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.planar import backward_arcs, folded_triangles, winding_words
from cembench.conformal.untangling import untangled
from cembench.core.arrays import Complex, Indices, Real, marked, numbered
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

#: Gap between boundary vertices that changed places, in radians: just enough to be distinct in
#: doubles.
MIN_ARC = 1e-12
#: Outward shift of the tip of a triangle with all corners on the circle, if they are so close that
#: the triangle has no area in doubles.
HEIGHT = 4 * np.finfo(float).eps
#: Changes of an angle up to this size are ignored.
MOVED = 1e-14
#: Largest share of the boundary's arcs that may run backward.
MAX_BACKWARD = 0.1
#: Numbers of rings of vertices around the folds that are laid out again, in this order.
RINGS = (1, 2, 4, 8, 16)


def without_folds(mesh: DiskMesh, L: scipy.sparse.csc_array, z: Complex) -> tuple[Complex, int]:
    """Repair the folds of a map to the disk that is nearly harmonic for L.

    Boundary vertices that changed places on the circle get the nearest angles in order, and the
    interior is solved for again. Remaining folds are repaired as in
    :func:`interior_without_folds`. A map without folds is returned unchanged.

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    L : sparse (n, n)
        Its Laplacian.
    z : complex (n,)
        The map, with its boundary on the unit circle.

    Returns
    -------
    z : complex (n,)
        The map. Folds that could not be repaired remain.
    rounds : int
        The number of rounds of repair; 0 if z was not folded.

    Raises
    ------
    AlgorithmFailed
        The boundary is too far out of order to be repaired.

    Examples
    --------
    >>> import cembench
    >>> from cembench.conformal.laplacian import laplacian
    >>> disk = cembench.surface("flat-disk", 600)
    >>> z, rounds = without_folds(disk, laplacian(disk), disk.V[:, 0] + 1j * disk.V[:, 1])
    >>> rounds
    0
    """
    if not len(_folded(mesh, z)):
        return z, 0
    rounds = 0
    circle = z[mesh.boundary]
    ordered = _on_boundary_without_folds(mesh, circle)
    if not np.array_equal(ordered, circle):
        z = harmonic_extension(L, mesh.boundary, ordered)
        rounds = 1
    z, more = interior_without_folds(mesh, z)
    return z, rounds + more


def interior_without_folds(
    mesh: TriangleMesh, z: Complex, rings: Sequence[int] = RINGS
) -> tuple[Complex, int]:
    """Repair the interior of a map around its folds; the boundary stays.

    Vertices within a few rings of a fold are laid out again, with everything else fixed. If a fold
    remains, they are put back and more rings are tried, up to the last of `rings`. Returns as
    :func:`without_folds`.
    """
    folded = _folded(mesh, z)
    if not len(folded):
        return z, 0
    rounds = 0
    with phase("folds"):
        held = marked(mesh.n, np.concatenate(mesh.loops))
        graph = vertex_graph(mesh.F, mesh.n)
        for count in rings:
            folded = folded[~held[mesh.F[folded]].all(axis=1)]
            if not len(folded):
                break
            near = marked(mesh.n, mesh.F[folded])
            for _ in range(count):
                near |= graph @ near.astype(np.float64) > 0
            z = _accepted(mesh, z, *untangled(mesh, z, near & ~held, graph))
            folded = folded_triangles(z, mesh.F)
            rounds += 1
    return z, rounds


def _accepted(mesh: TriangleMesh, before: Complex, after: Complex, patch: Indices) -> Complex:
    """Return the repaired map, with patches that still have folds put back."""
    folded = np.unique(patch[folded_triangles(after, mesh.F)])
    back = np.unique(mesh.F[np.isin(patch, folded[folded >= 0])])
    accepted = after.copy()
    accepted[back] = before[back]
    return accepted


def _folded(mesh: TriangleMesh, z: Complex) -> Indices:
    """Return the folded triangles, in the phase "folds"."""
    with phase("folds"):
        return folded_triangles(z, mesh.F)


def _on_boundary_without_folds(mesh: DiskMesh, circle: Complex) -> Complex:
    """Return the boundary in order, such that no triangle between its vertices has zero area."""
    ordered = in_order(circle)
    place = numbered(mesh.n, mesh.boundary)
    corners = place[mesh.F]
    corners = corners[(corners >= 0).all(axis=1)]
    flat = corners[folded_triangles(ordered, corners)]
    sides = np.abs(ordered[np.roll(flat, -2, axis=1)] - ordered[np.roll(flat, -1, axis=1)])
    tips = np.take_along_axis(flat, sides.argmax(axis=1)[:, None], axis=1)
    ordered[np.unique(tips)] *= 1 + HEIGHT
    return ordered


def in_order(circle: Complex, least: float | Real = MIN_ARC) -> Complex:
    """Return the nearest points of the unit circle that go around it counter-clockwise.

    The angles (k,) are replaced by their isotonic regression; points that are in order stay. Points
    that changed places with each other are spread evenly over at least the part of the circle by
    which they were out of order; no arc is shorter than `least`, in radians: one number, or one
    (k,) for the arc from each point to the next.

    Raises
    ------
    AlgorithmFailed
        The points do not go around the circle once and counter-clockwise, or more than the share
        `MAX_BACKWARD` of their arcs runs backward.
    """
    arcs = np.angle(np.roll(circle, -1) / circle)
    first = int(np.argmax(arcs)) + 1  # cut the circle where points are least crowded
    arcs = np.roll(arcs, -first)
    angles = np.concatenate([[0.0], np.cumsum(arcs[:-1])])
    least = np.roll(np.broadcast_to(least, len(circle)), -first)
    turned = _in_order(angles, least) - angles
    cut = np.roll(circle, -first)
    moved = np.abs(turned) > MOVED
    ordered = np.roll(np.where(moved, cut[0] * np.exp(1j * (angles + turned)), cut), first)
    turns = round(arcs.sum() / (2 * np.pi))
    scrambled = backward_arcs(circle) > MAX_BACKWARD * len(circle)
    if turns != 1:
        raise AlgorithmFailed(
            f"the boundary {winding_words(turns)}; it must go around it once, counter-clockwise, "
            "and no repair of its order changes that"
        )
    if scrambled or backward_arcs(ordered):
        raise AlgorithmFailed(
            f"{backward_arcs(circle)} of the boundary's {len(circle)} arcs go backward or have no "
            f"length, more than the share of {MAX_BACKWARD:.0%} whose order can be repaired"
        )
    return ordered


def _in_order(angles: Real, least: Real) -> Real:
    """Return the isotonic regression of angles, each `least` before the next one."""
    from scipy.optimize import isotonic_regression  # slow to load, and rarely needed

    spread = np.cumsum(least) - least
    # Groups that changed places; each would collapse to one point.
    first = np.asarray(isotonic_regression(angles - spread).blocks)[:-1]
    sizes = np.diff(np.append(first, len(angles)))
    disorder = np.maximum.reduceat(angles, first) - np.minimum.reduceat(angles, first)
    apart = np.maximum(least, np.repeat(disorder / sizes, sizes))
    spread = np.cumsum(apart) - apart
    return np.asarray(isotonic_regression(angles - spread).x + spread)
