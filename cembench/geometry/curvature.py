"""Mean curvature from the cotangent Laplacian."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.geometry import topology
from cembench.geometry.laplacian import cotangent_laplacian
from cembench.geometry.mesh import TriangleMesh


def mean_curvature(mesh: TriangleMesh) -> NDArray[np.float64]:
    """How curved is the surface at each vertex: the mean of both principal curvatures?

    Shape (n,), in one over the unit of V; positive where the surface bulges outwards (1 on a unit
    sphere). ``L V = 2 H A n`` with A a third of the area round the vertex (Meyer et al. 2003). On
    the boundary, where that says nothing, it is the mean over the interior neighbours, or 0.
    """
    V, F, n = mesh.V, mesh.F, mesh.n
    corner = V[F[:, 0]]
    doubled = np.cross(V[F[:, 1]] - corner, V[F[:, 2]] - corner)
    normal = np.zeros((n, 3))
    area = np.zeros(n)
    for c in range(3):
        np.add.at(normal, F[:, c], doubled)
        np.add.at(area, F[:, c], np.linalg.norm(doubled, axis=1) / 6)
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1.0)[:, None]
    H = np.einsum("vd,vd->v", cotangent_laplacian(V, F) @ V, normal) / (2 * area)
    return _continued_to_boundary(mesh, H)


def _continued_to_boundary(mesh: TriangleMesh, H: NDArray[np.float64]) -> NDArray[np.float64]:
    inside = np.zeros(mesh.n)
    inside[mesh.interior] = 1.0
    graph = topology.vertex_graph(mesh.F, mesh.n).astype(bool).astype(float)
    neighbours = graph @ inside
    mean = (graph @ (inside * H)) / np.maximum(neighbours, 1)
    return np.where(inside > 0, H, mean)
