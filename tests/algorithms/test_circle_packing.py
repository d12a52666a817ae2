import numpy as np
import pytest
from cembench.algorithms.circle_packing import _packed, _Packing, circle_packing
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import DiskMesh
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.topology import undirected_edges


def wheel(k):
    angle = 2 * np.pi * np.arange(k) / k
    V = np.column_stack([np.r_[0, np.cos(angle)], np.r_[0, np.sin(angle)], np.r_[1.0, angle]])
    F = [[0, 1 + i, 1 + (i + 1) % k] for i in range(k)]
    return DiskMesh.from_arrays(V, F)


@pytest.mark.parametrize("k", [4, 6, 9])
def test_a_wheel_is_packed_as_known(k):
    """The k circles round the one in the middle touch the unit circle and each other."""
    packing = _Packing(wheel(k))
    _packed(packing, 1e-10, 100)
    sine = np.sin(np.pi / k)
    assert packing.radii[1:] == pytest.approx(sine / (1 + sine))
    assert packing.radii[0] == pytest.approx((1 - sine) / (1 + sine))


def test_circles_touch_along_every_edge_and_the_unit_circle():
    mesh = hemi_ellipsoid(400)
    packing = _Packing(mesh)
    z, history = _packed(packing, 1e-8, 500)
    assert history[-1] < 1e-8
    i, j = undirected_edges(mesh.F)[0].T
    r = packing.radii
    assert abs(abs(z[i] - z[j]) - (r[i] + r[j])).max() < 1e-6
    assert abs(abs(z[mesh.boundary]) + r[mesh.boundary] - 1).max() < 1e-12


def test_it_ignores_geometry():
    mesh = hemi_ellipsoid(400)
    V = mesh.V + 0.05 * np.random.default_rng(0).standard_normal(mesh.V.shape)
    packings = [_packed(_Packing(m), 1e-8, 500)[0] for m in (mesh, mesh.moved(V))]
    assert abs(packings[0] - packings[1]).max() < 1e-12
    result = circle_packing(mesh)
    assert result.extras["ignores"] == "geometry"
    assert result.extras["angle_sum"] < 1e-6


def test_a_symmetric_disk_is_packed_symmetrically():
    mesh = flat_disk(600)
    z = circle_packing(mesh).uv
    assert abs(z[0]) < 1e-6
    sides = side_lengths(np.stack([z.real, z.imag], axis=1), mesh.F)
    assert sides.min() > 0
