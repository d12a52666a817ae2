"""The cotangent Laplacian (Eq. 6).

Sign convention: positive semi-definite, rows sum to zero, ``L[i, j]`` is minus half the sum of the
cotangents opposite to edge ij. It is positive exactly if an interior edge is not Delaunay.
"""

from __future__ import annotations

import numpy as np
import scipy

from cembench.conformal.intrinsic_delaunay import intrinsic_delaunay, opposite_to_obtuse
from cembench.core.arrays import Indices, Real
from cembench.core.blocks import blocks, in_blocks
from cembench.core.clock import phase
from cembench.mesh.gluing import SLOTS, opposite_edge_ends, twins_of_half_edges
from cembench.mesh.triangle_mesh import TriangleMesh


def corner_products(V: Real, F: Indices) -> tuple[Real, Real]:
    """Return the dot products (m, 3) of the edges at each corner, and twice the areas (m,).

    V is (n, d) with d = 2 or 3; the corner ``[t, c]`` is at vertex ``F[t, c]``. Areas are unsigned.
    """
    dots, double_area = np.empty((len(F), 3)), np.empty(len(F))
    for block in blocks(len(F)):
        dots[block], double_area[block] = _products(*_opposite_edges(V, F[block]))
    return dots, double_area


def _opposite_edges(V: Real, F: Indices) -> tuple[Real, Real, Real]:
    """The edges (m, d) opposite to the corners 0, 1, 2."""
    a, b, c = (V.take(F[:, k], axis=0) for k in range(3))
    return c - b, a - c, b - a


def _products(e0: Real, e1: Real, e2: Real) -> tuple[Real, Real]:
    dots = np.empty((len(e0), 3))
    for k, (p, q) in enumerate(((e1, e2), (e2, e0), (e0, e1))):
        np.einsum("td,td->t", p, q, out=dots[:, k])
    np.negative(dots, out=dots)
    return dots, _double_areas(e1, e2)


def double_areas(V: Real, F: Indices) -> Real:
    """Return twice the area of each triangle (m,), unsigned; V is (n, 2 or 3)."""
    return in_blocks(lambda some: _double_areas(*_opposite_edges(V, some)[1:]), F)


def _double_areas(e1: Real, e2: Real) -> Real:
    # Lagrange's identity through the dot products alone would cancel on slivers.
    if e1.shape[1] == 2:
        return np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
    x = e1[:, 1] * e2[:, 2] - e1[:, 2] * e2[:, 1]
    y = e1[:, 2] * e2[:, 0] - e1[:, 0] * e2[:, 2]
    z = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def half_cotangents(V: Real, F: Indices) -> Real:
    """Return half the cotangent of each corner's angle, shape (m, 3), dimensionless.

    V and corners as for :func:`corner_products`.
    """
    dots, double_area = corner_products(V, F)
    dots /= 2 * double_area[:, None]
    return dots


def laplacian_of_weights(F: Indices, weights: Real, n: int) -> scipy.sparse.csc_array:
    """Return the Laplacian of `weights` (m, 3), for the edges opposite to the corners.

    The weights of the two triangles of an edge are added.
    """
    F = F.astype(np.int32 if n < 2**31 else np.int64, copy=False)  # as SciPy will have them
    one_way = scipy.sparse.coo_array((weights.ravel(), opposite_edge_ends(F)), shape=(n, n))
    # Else SciPy sorts each row; turning rows into columns sorts them too, at half the cost.
    one_way.has_canonical_format = True
    by_column = one_way.tocsr().tocsc()
    by_column.sum_duplicates()  # flipped edges may have the same ends
    W = by_column.tocsr() + scipy.sparse.csr_array(by_column.T)
    # Symmetric to the last bit, so its rows are its columns.
    return scipy.sparse.csc_array(
        scipy.sparse.csr_array(scipy.sparse.diags_array(W.sum(axis=1)) - W).T
    )


def cotangent_laplacian(V: Real, F: Indices) -> scipy.sparse.csc_array:
    """Return the positive semi-definite cotangent Laplacian (n, n) of Eq. (6); V (n, 2 or 3)."""
    return laplacian_of_weights(F, half_cotangents(V, F), len(V))


def laplacian(mesh: TriangleMesh, *, delaunay: bool = False) -> scipy.sparse.csc_array:
    """Return the cotangent Laplacian of a mesh, in the phase "laplacian".

    All algorithms share this function.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    delaunay : bool
        Whether to use the intrinsic Delaunay triangulation of the same surface [1]_. Then no weight
        is negative, and harmonic maps obey a discrete maximum principle.

    Returns
    -------
    sparse (n, n)
        Positive semi-definite; rows sum to zero (Eq. 6).

    References
    ----------
    .. [1] Fisher, Springborn, Schroeder, Bobenko, "An algorithm for the construction of intrinsic
           Delaunay triangulations with applications to digital geometry processing",
           Computing 81, 2007.

    Examples
    --------
    >>> import cembench
    >>> L = laplacian(cembench.surface("flat-disk", 600))
    >>> bool(abs(L.sum(axis=1)).max() < 1e-12)
    True
    """
    if delaunay:
        return delaunay_laplacian(mesh)[0]
    with phase("laplacian"):
        return cotangent_laplacian(mesh.V, mesh.F)


def delaunay_laplacian(mesh: TriangleMesh) -> tuple[scipy.sparse.csc_array, float]:
    """Return the Laplacian (n, n) of the intrinsic Delaunay triangulation of a mesh.

    And the share of corners that flips moved to another vertex.
    """
    with phase("laplacian"):
        lengths, weights = np.empty((mesh.m, 3)), np.empty((mesh.m, 3))
        for block in blocks(mesh.m):
            edges = _opposite_edges(mesh.V, mesh.F[block])
            dots, double_area = _products(*edges)
            weights[block] = dots / (2 * double_area[:, None])
            for k, e in enumerate(edges):
                lengths[block, k] = np.sqrt(sum(x * x for x in e.T))
        small = mesh.n * SLOTS < 2**31
        before: Indices = mesh.F.astype(np.int32 if small else np.int64)
        F, _, weights = intrinsic_delaunay(before, lengths, weights)
        changed = 0 if F is before else np.count_nonzero(before != F)
        return laplacian_of_weights(F, weights, mesh.n), changed / F.size


def by_rows(L: scipy.sparse.csc_array) -> scipy.sparse.csr_array:
    """Return a Laplacian stored by rows; by symmetry these are its columns."""
    return scipy.sparse.csr_array(L.T)


def non_delaunay_share(mesh: TriangleMesh) -> float:
    """Return the share of interior edges with opposite angles above 180 degrees in sum."""
    weights = half_cotangents(mesh.V, mesh.F)
    near = opposite_to_obtuse(mesh.F, weights)
    twin = twins_of_half_edges(mesh.F[near])
    inside = np.flatnonzero(twin >= 0)  # every edge twice
    weight = weights[near][:, [2, 0, 1]].ravel()  # of the half-edges
    bad = np.count_nonzero(weight[inside] + weight[twin[inside]] < -1e-12)
    interior = mesh.F.size - sum(len(loop) for loop in mesh.loops)
    return bad / interior if interior else 0.0
