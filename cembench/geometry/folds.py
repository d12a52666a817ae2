"""Folded triangles in a map to the disk, and how to lay them flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.clock import phase
from cembench.errors import AlgorithmFailed
from cembench.geometry.harmonic import harmonic_extension
from cembench.geometry.mesh import DiskMesh
from cembench.geometry.planar import backward_arcs, signed_areas
from cembench.geometry.topology import vertex_graph

Complex = NDArray[np.complex128]

#: What replaces a weight that is not positive, as a share of the mean weight.
LEAST_WEIGHT = 0.01


def without_folds(mesh: DiskMesh, L: sparse.csc_array, z: Complex) -> tuple[Complex, int]:
    """Which map has the boundary of the harmonic map z, but no folded triangle?

    A harmonic map to a convex polygon can fold only where an edge has a weight that is not
    positive (Tutte 1963, Floater 2003). Around folded triangles such weights are raised to
    `LEAST_WEIGHT` of the mean one and the map is solved for again; the neighbourhood doubles until
    nothing is folded, and in the end takes in the whole mesh, where the theorem applies. A map
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
        The boundary does not go round the circle once, counter-clockwise; or folds remain.

    """
    folded = _folded(mesh, z)
    if not len(folded):
        return z, 0
    _check_order(z[mesh.boundary])
    with phase("folds"):
        graph = vertex_graph(mesh.F, mesh.n)
        near = np.zeros(mesh.n, dtype=bool)
    rounds, rings = 0, 1
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
            near |= rings > mesh.n
            convex = _convexified(L, near)
        z = harmonic_extension(convex, mesh.boundary, z[mesh.boundary])
        folded = _folded(mesh, z)
        rounds, rings = rounds + 1, 2 * rings
    return z, rounds


def _folded(mesh: DiskMesh, z: Complex) -> NDArray[np.int64]:
    return np.flatnonzero(~(signed_areas(z, mesh.F) > 0))


def _check_order(circle: Complex) -> None:
    backward = backward_arcs(circle)
    turns = np.angle(np.roll(circle, -1) / circle).sum() / (2 * np.pi)
    if backward or round(turns) != 1:
        raise AlgorithmFailed(
            "the boundary does not go round the circle once and counter-clockwise: "
            f"{backward} of its {len(circle)} arcs go backward or nowhere, and it makes "
            f"{turns:.0f} turn(s); no map of the interior can undo such a fold"
        )


def _convexified(L: sparse.csc_array, near: NDArray[np.bool_]) -> sparse.csc_array:
    """L with the weights of all edges at the vertices `near` made positive."""
    W = sparse.coo_array(-L)
    off = W.row != W.col
    i, j, w = W.row[off], W.col[off], W.data[off]
    least = LEAST_WEIGHT * float(w[w > 0].mean())
    w = np.where(near[i] | near[j], np.maximum(w, least), w)
    W = sparse.coo_array((w, (i, j)), shape=L.shape).tocsr()
    return sparse.csc_array(sparse.diags_array(W.sum(axis=1)) - W)
