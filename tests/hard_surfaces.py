"""Disks on which harmonic maps fold: made from a number, for tests."""

import numpy as np
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy.spatial import Delaunay

from cembench import DiskMesh
from tests import gallery


def hard_surface(seed):
    kinds = (_crumpled, _strip, _stretched, _spikes, _irregular)
    rng = np.random.default_rng(seed)
    V, F = kinds[seed % len(kinds)](rng)
    return DiskMesh.from_arrays(V, F, name=f"hard {seed}")


def _crumpled(rng):
    """Noise on a flat disk."""
    mesh = flat_disk(int(rng.integers(300, 1500)))
    spacing = np.sqrt(np.pi / mesh.n)
    return mesh.V + rng.uniform(0.2, 0.9) * spacing * rng.standard_normal(mesh.V.shape), mesh.F


def _strip(rng):
    """A long strip, on which the boundary crowds, with noise and ears."""
    rows = int(rng.integers(4, 10))
    V, F = gallery.flat_rectangle(rows, rows * int(rng.integers(3, 11)))
    return V + rng.uniform(0.02, 0.2) * rng.standard_normal(V.shape), F


def _stretched(rng):
    """A deep, narrow bowl of noise and anisotropic triangles."""
    mesh = hemi_ellipsoid(int(rng.integers(300, 1500)), x=rng.uniform(1, 3), z=rng.uniform(1, 6))
    return mesh.V + rng.uniform(0.01, 0.06) * rng.standard_normal(mesh.V.shape), mesh.F


def _spikes(rng):
    """A flat disk from which fingers stand out, a few triangles wide."""
    mesh = flat_disk(int(rng.integers(400, 1500)))
    V = mesh.V.copy()
    for _ in range(int(rng.integers(1, 6))):
        middle = rng.uniform(-0.6, 0.6, 2)
        away = ((V[:, :2] - middle) ** 2).sum(axis=1)
        V[:, 2] += rng.uniform(0.5, 3) * np.exp(-away / rng.uniform(0.05, 0.2) ** 2)
    return V, mesh.F


def _irregular(rng):
    """Random points in a disk, slivers and fans included, under a bumpy height field."""
    angle = 2 * np.pi * np.arange(40) / 40
    inside = rng.uniform(-1, 1, (int(rng.integers(200, 700)), 2))
    inside = inside[(inside**2).sum(axis=1) < 0.95]
    flat = np.concatenate([np.stack([np.cos(angle), np.sin(angle)], axis=1), inside])
    height = sum(
        rng.uniform(0, 0.3) * np.sin(rng.uniform(1, 12, 2) @ flat.T + rng.uniform(0, 6))
        for _ in range(4)
    )
    F = Delaunay(flat).simplices.astype(np.int64)
    p, q = flat[F[:, 1]] - flat[F[:, 0]], flat[F[:, 2]] - flat[F[:, 0]]
    turned = p[:, 0] * q[:, 1] < p[:, 1] * q[:, 0]
    F[turned] = F[turned][:, ::-1]
    return np.column_stack([flat, height]), F
