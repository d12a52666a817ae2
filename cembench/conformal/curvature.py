"""Mean curvature from the cotangent Laplacian."""

from __future__ import annotations

import numpy as np

from cembench.conformal.laplacian import cotangent_laplacian, half_cotangents
from cembench.core.arrays import Indices, Real
from cembench.mesh import topology
from cembench.mesh.triangle_mesh import TriangleMesh


def mean_curvature(mesh: TriangleMesh) -> Real:
    """Return the mean curvature at each vertex: the mean of both principal curvatures.

    Shape (n,), in one over the unit of V; positive where the surface bulges outwards (1 on a unit
    sphere). ``L V = 2 H A n`` with A the mixed Voronoi area of the vertex (Meyer et al. 2003). On
    the boundary, where this does not apply, it is the mean over interior neighbours, or 0.
    """
    V, F, n = mesh.V, mesh.F, mesh.n
    corner = V[F[:, 0]]
    doubled = np.cross(V[F[:, 1]] - corner, V[F[:, 2]] - corner)
    shares = _mixed_areas(V, F, np.linalg.norm(doubled, axis=1) / 2)
    normal = np.zeros((n, 3))
    area = np.zeros(n)
    for c in range(3):
        np.add.at(normal, F[:, c], doubled)
        np.add.at(area, F[:, c], shares[:, c])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1.0)[:, None]
    H = np.einsum("vd,vd->v", cotangent_laplacian(V, F) @ V, normal) / (2 * area)
    return _continued_to_boundary(mesh, H)


def mixed_vertex_areas(mesh: TriangleMesh) -> Real:
    """Return the mixed Voronoi area of each vertex (n,) (Meyer et al. 2003)."""
    a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    shares = _mixed_areas(mesh.V, mesh.F, areas)
    owned = np.bincount(mesh.F.ravel(), shares.ravel(), mesh.n)
    return np.asarray(owned, dtype=np.float64)


def _mixed_areas(V: Real, F: Indices, areas: Real) -> Real:
    """Return the part of each triangle that belongs to each of its corners, shape (m, 3).

    This is the Voronoi part; an obtuse triangle gives half to its obtuse corner and a quarter to
    each other corner.
    """
    half = half_cotangents(V, F)
    opposite = np.linalg.norm(V[F[:, [1, 2, 0]]] - V[F[:, [2, 0, 1]]], axis=2) ** 2
    weighted = half * opposite / 4
    voronoi = weighted.sum(axis=1, keepdims=True) - weighted
    obtuse = half < 0
    cut = areas[:, None] * np.where(obtuse, 0.5, 0.25)
    return np.where(obtuse.any(axis=1, keepdims=True), cut, voronoi)


def _continued_to_boundary(mesh: TriangleMesh, H: Real) -> Real:
    """Give boundary vertices the mean of their interior neighbours."""
    inside = np.zeros(mesh.n)
    inside[mesh.interior] = 1.0
    graph = topology.vertex_graph(mesh.F, mesh.n).astype(bool).astype(float)
    neighbours = graph @ inside
    mean = (graph @ (inside * H)) / np.maximum(neighbours, 1)
    return np.where(inside > 0, H, mean)
