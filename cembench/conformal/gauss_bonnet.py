"""Curvature of a polyhedral surface: the angle defect at each vertex."""

from __future__ import annotations

import numpy as np

from cembench.conformal.metrics import corner_angles
from cembench.core.arrays import Real
from cembench.mesh.triangle_mesh import DiskMesh


def vertex_curvatures(mesh: DiskMesh) -> Real:
    """Return the angle defects (n,) in radians: 2 pi (interior) or pi (boundary) less the angles.

    Their sum is 2 pi for every disk (Gauss-Bonnet).
    """
    angles = np.deg2rad(corner_angles(mesh.V, mesh.F))
    flat = np.full(mesh.n, 2 * np.pi)
    flat[mesh.boundary] = np.pi
    return flat - np.bincount(mesh.F.ravel(), weights=angles.ravel(), minlength=mesh.n)
