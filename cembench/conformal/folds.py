"""Folded triangles in a map to the disk, and their repair, which is local.

The boundary stays where the method put it, but for vertices that changed places; then patches of
the interior around the folds are laid out anew (:mod:`cembench.conformal.untangling`), everything
else being held. What cannot be repaired that way stays folded: a map that is made fold-free at the
price of its angles is of no use to anybody.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.planar import backward_arcs, folded_triangles
from cembench.conformal.untangling import untangled
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: What remains between boundary vertices that changed places, in radians: only so much that doubles
#: tell them apart.
LEAST_ARC = 1e-12
#: By how much the tip of a triangle whose corners all lie on the circle is taken off it, outward,
#: where they are so close together that the triangle has no area in doubles.
HEIGHT = 4 * np.finfo(float).eps
#: An angle that changes by no more than this is left as it is.
MOVED = 1e-14
#: What share of the boundary's arcs may go backward and still count as a few.
MOST_BACKWARD = 0.1
#: How many rings of vertices around the folds are laid out anew, one after the other.
RINGS = (1, 2, 4, 8, 16)


def without_folds(mesh: DiskMesh, L: sparse.csc_array, z: Complex) -> tuple[Complex, int]:
    """Repair a map to the disk that is nearly harmonic for L.

    Where boundary vertices changed places on the circle, they take the nearest angles in order, and
    the interior is solved for again. What is folded then is repaired as in
    :func:`interior_without_folds`. A map without folds comes back untouched.

    Returns
    -------
    z : complex (n,)
        The map. Folds that could not be repaired are still there.
    rounds : int
        How many rounds of repair that took; 0 where z was not folded.

    Raises
    ------
    AlgorithmFailed
        The boundary is too far out of order to be repaired.

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


def interior_without_folds(mesh: TriangleMesh, z: Complex) -> tuple[Complex, int]:
    """Repair the interior of a map around its folds; the boundary stays.

    The vertices within a few rings of a fold are laid out anew, everything else held; where that
    leaves a fold, they go back and more rings are taken, up to the last of `RINGS`. Returns what
    :func:`without_folds` does.
    """
    folded = _folded(mesh, z)
    if not len(folded):
        return z, 0
    rounds = 0
    with phase("folds"):
        held = np.zeros(mesh.n, dtype=bool)
        held[np.concatenate(mesh.loops)] = True
        graph = vertex_graph(mesh.F, mesh.n)
        for rings in RINGS:
            folded = folded[~held[mesh.F[folded]].all(axis=1)]
            if not len(folded):
                break
            near = np.zeros(mesh.n, dtype=bool)
            near[mesh.F[folded]] = True
            for _ in range(rings):
                near |= graph @ near.astype(np.float64) > 0
            z = _accepted(mesh, z, *untangled(mesh, z, near & ~held, graph))
            folded = folded_triangles(z, mesh.F)
            rounds += 1
    return z, rounds


def _accepted(
    mesh: TriangleMesh, before: Complex, after: Complex, patch: NDArray[np.int64]
) -> Complex:
    """Return the map after, with those patches as before that still have folds."""
    folded = np.unique(patch[folded_triangles(after, mesh.F)])
    back = np.unique(mesh.F[np.isin(patch, folded[folded >= 0])])
    accepted = after.copy()
    accepted[back] = before[back]
    return accepted


def _folded(mesh: TriangleMesh, z: Complex) -> NDArray[np.int64]:
    with phase("folds"):
        return folded_triangles(z, mesh.F)


def _on_boundary_without_folds(mesh: DiskMesh, circle: Complex) -> Complex:
    """Return the boundary in order, no triangle between its vertices alone without area."""
    ordered = in_order(circle)
    place = np.full(mesh.n, -1)
    place[mesh.boundary] = np.arange(len(circle))
    corners = place[mesh.F]
    corners = corners[(corners >= 0).all(axis=1)]
    flat = corners[folded_triangles(ordered, corners)]
    sides = np.abs(ordered[np.roll(flat, -2, axis=1)] - ordered[np.roll(flat, -1, axis=1)])
    tips = np.take_along_axis(flat, sides.argmax(axis=1)[:, None], axis=1)
    ordered[np.unique(tips)] *= 1 + HEIGHT
    return ordered


def in_order(circle: Complex) -> Complex:
    """Return the points of the unit circle nearest to these that go round it counter-clockwise.

    The angles (k,) are replaced by their isotonic regression; points that are in order stay as they
    are. Those that changed places among each other are spread evenly over at least as much of the
    circle as they were out of order by; no two are closer together than `LEAST_ARC`.

    Raises
    ------
    AlgorithmFailed
        The points do not go round the circle once and counter-clockwise, or more than the share
        `MOST_BACKWARD` of the arcs between them goes backward.

    """
    arcs = np.angle(np.roll(circle, -1) / circle)
    first = int(np.argmax(arcs)) + 1  # cut the circle where it is least crowded
    arcs = np.roll(arcs, -first)
    angles = np.concatenate([[0.0], np.cumsum(arcs[:-1])])
    turned = _in_order(angles) - angles
    cut = np.roll(circle, -first)
    moved = np.abs(turned) > MOVED
    ordered = np.roll(np.where(moved, cut[0] * np.exp(1j * (angles + turned)), cut), first)
    turns = round(arcs.sum() / (2 * np.pi))
    scrambled = backward_arcs(circle) > MOST_BACKWARD * len(circle)
    if turns != 1 or scrambled or backward_arcs(ordered):
        raise AlgorithmFailed(
            f"the boundary goes round the circle {turns} time(s) counter-clockwise (once is "
            f"right), and {backward_arcs(circle)} of its {len(circle)} arcs go backward or "
            "nowhere: too far out of order to be repaired"
        )
    return ordered


def _in_order(angles: Real) -> Real:
    from scipy.optimize import isotonic_regression  # slow to load, and rarely needed

    spread = LEAST_ARC * np.arange(len(angles))
    # Groups that changed places: each would come to lie in one point.
    first = np.asarray(isotonic_regression(angles - spread).blocks)[:-1]
    sizes = np.diff(np.append(first, len(angles)))
    disorder = np.maximum.reduceat(angles, first) - np.minimum.reduceat(angles, first)
    apart = np.repeat(np.maximum(LEAST_ARC, disorder / sizes), sizes)
    spread = np.cumsum(apart) - apart
    return np.asarray(isotonic_regression(angles - spread).x + spread)
