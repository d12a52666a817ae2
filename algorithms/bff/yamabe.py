"""The linear relation between the scale of a boundary and its exterior angles."""

from __future__ import annotations

import numpy as np

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.gauss_bonnet import vertex_curvatures
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.mesh.triangle_mesh import DiskMesh


class YamabeBoundary:
    """L u = (-Omega; k~ - k), interior eliminated, for a flat image (Sawhney & Crane, Eq. 14).

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    delaunay : bool
        Whether to use the weights of the intrinsic Delaunay triangulation.

    Attributes
    ----------
    L : sparse (n, n)
        The Laplacian, and as `bordered` with the boundary last.
    lengths : float (B,)
        From each boundary vertex to the next on the surface.
    natural : float (B,)
        Exterior angles k~ in radians if the boundary keeps its scale, u = 0; their sum is 2 pi.
    """

    def __init__(self, mesh: DiskMesh, *, delaunay: bool) -> None:
        self.L = laplacian(mesh, delaunay=delaunay)
        self.bordered = BorderedLaplacian(mesh, self.L, (mesh.boundary,))
        self._S = self.bordered.dirichlet_to_neumann()
        with phase("boundary"):
            curvature = vertex_curvatures(mesh)
            self.lengths = edge_lengths(mesh, mesh.boundary)
        # k - L_bi L_ii^-1 Omega is the curvature swept to the boundary.
        swept = self.bordered.swept_to_boundary(curvature[:, None] / curvature.sum())
        self.natural: Real = 2 * np.pi * swept[:, 0]

    def scale(self, turns: Real) -> Real:
        """Return the log scale u (B,) of mean 0 of a boundary with these exterior angles (B,)."""
        return np.asarray(self._S.inverse(turns - self.natural))

    def scaled(self, u: Real) -> Real:
        """Return the boundary's lengths (B,) after scaling vertices by exp(u)."""
        return np.asarray(self.lengths * np.exp((u + np.roll(u, -1)) / 2))
