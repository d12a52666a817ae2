"""Curvature of a polyhedral surface: what is missing to a flat angle at each vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import corner_angles
from cembench.mesh.triangle_mesh import DiskMesh

Real = NDArray[np.float64]


def vertex_curvatures(mesh: DiskMesh) -> Real:
    """Angle defects (n,) in radians: 2 pi less the angles inside, pi less them on the boundary.

    Their sum is 2 pi, whatever the surface (Gauss-Bonnet).
    """
    angles = np.deg2rad(corner_angles(mesh.V, mesh.F))
    flat = np.full(mesh.n, 2 * np.pi)
    flat[mesh.boundary] = np.pi
    return flat - np.bincount(mesh.F.ravel(), weights=angles.ravel(), minlength=mesh.n)
