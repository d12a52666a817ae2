"""Folded triangles in a map to the disk, and how to lay them flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.planar import backward_arcs, signed_areas
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Complex = NDArray[np.complex128]

#: What replaces a weight that is not positive, as a share of the mean weight.
LEAST_WEIGHT = 0.01
#: What remains between boundary vertices that changed places, as a share of the mean arc.
LEAST_ARC = 0.01
#: What share of the boundary's arcs may go backward and still count as a few.
MOST_BACKWARD = 0.1


def without_folds(mesh: DiskMesh, L: sparse.csc_array, z: Complex) -> tuple[Complex, int]:
    """Which map to the disk is nearly the harmonic map z, but has no folded triangle?

    Two causes are mended. Where a few boundary vertices changed places on the circle, they take the
    nearest angles in order; then the interior is as in :func:`interior_without_folds`. A map
    without folds comes back untouched.

    Returns
    -------
    z : complex (n,)
        The map.
    rounds : int
        How many solves that took; 0 where z was not folded.

    Raises
    ------
    AlgorithmFailed
        The boundary is too far out of order to be repaired, or folds remain.

    """
    if not len(_folded(mesh, z)):
        return z, 0
    rounds = 0
    if backward_arcs(z[mesh.boundary]):
        z = harmonic_extension(L, mesh.boundary, in_order(z[mesh.boundary]))
        rounds = 1
    z, more = interior_without_folds(mesh, L, z)
    return z, rounds + more


def interior_without_folds(
    mesh: TriangleMesh, L: sparse.csc_array, z: Complex
) -> tuple[Complex, int]:
    """Which map has the boundary of the harmonic map z, but no folded triangle?

    A harmonic map to a convex polygon can fold only where an edge has a weight that is not positive
    (Tutte 1963, Floater 2003): around folded triangles such weights are raised to `LEAST_WEIGHT` of
    the mean one and the map is solved for again; the neighbourhood doubles until nothing is folded,
    and in the end takes in the whole mesh, where the theorem applies. Returns and raises what
    :func:`without_folds` does.
    """
    folded = _folded(mesh, z)
    if not len(folded):
        return z, 0
    rounds, rings = 0, 1
    with phase("folds"):
        graph = vertex_graph(mesh.F, mesh.n)
        near = np.zeros(mesh.n, dtype=bool)
    while len(folded):
        if near.all():
            raise AlgorithmFailed(
                f"{len(folded)} folded triangle(s) remain even with all weights positive, the "
                f"first of vertices {mesh.F[folded[0]].tolist()}: the image of its surroundings "
                "is smaller than rounding errors, or its corners have no way to the interior"
            )
        with phase("folds"):
            near[mesh.F[folded]] = True
            for _ in range(rings):
                near |= graph @ near.astype(np.float64) > 0
                if near.all():
                    break
            convex = _convexified(L, near)
        boundary = np.concatenate(mesh.loops)
        z = harmonic_extension(convex, boundary, z[boundary])
        folded = _folded(mesh, z)
        rounds, rings = rounds + 1, 2 * rings
    return z, rounds


def _folded(mesh: TriangleMesh, z: Complex) -> NDArray[np.int64]:
    with phase("folds"):
        return np.flatnonzero(~(signed_areas(z, mesh.F) > 0))


def in_order(circle: Complex) -> Complex:
    """Which points of the unit circle lie nearest to these, but go round it counter-clockwise?

    The angles (k,) are replaced by their isotonic regression, with at least `LEAST_ARC` of the mean
    arc between neighbours.

    Raises
    ------
    AlgorithmFailed
        The points do not go round the circle once and counter-clockwise, or more than the share
        `MOST_BACKWARD` of the arcs between them goes backward.

    """
    arcs = np.angle(np.roll(circle, -1) / circle)
    first = int(np.argmax(arcs)) + 1  # cut the circle where it is least crowded
    arcs = np.roll(arcs, -first)
    spread = LEAST_ARC * 2 * np.pi / len(circle) * np.arange(len(circle))
    angles = np.concatenate([[0.0], np.cumsum(arcs[:-1])])
    from scipy.optimize import isotonic_regression  # slow to load, and rarely needed

    angles = isotonic_regression(angles - spread).x + spread
    ordered = np.roll(np.exp(1j * angles) * np.roll(circle, -first)[0], first)
    turns = round(arcs.sum() / (2 * np.pi))
    scrambled = backward_arcs(circle) > MOST_BACKWARD * len(circle)
    if turns != 1 or scrambled or backward_arcs(ordered):
        raise AlgorithmFailed(
            f"the boundary goes round the circle {turns} time(s) counter-clockwise (once is "
            f"right), and {backward_arcs(circle)} of its {len(circle)} arcs go backward or "
            "nowhere: too far out of order to be repaired"
        )
    return ordered


def _convexified(L: sparse.csc_array, near: NDArray[np.bool_]) -> sparse.csc_array:
    """L with the weights of all edges at the vertices `near` made positive."""
    W = sparse.coo_array(-L)
    off = W.row != W.col
    i, j, w = W.row[off], W.col[off], W.data[off]
    least = LEAST_WEIGHT * float(w[w > 0].mean())
    w = np.where(near[i] | near[j], np.maximum(w, least), w)
    W = sparse.coo_array((w, (i, j)), shape=L.shape).tocsr()
    return sparse.csc_array(sparse.diags_array(W.sum(axis=1)) - W)
