import numpy as np
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import DiskMesh, TriangleMesh
from cembench.conformal.doubling import doubled, doubled_laplacian
from cembench.conformal.laplacian import cotangent_laplacian, laplacian
from cembench.mesh.topology import euler_characteristic, repeated_half_edges
from tests import gallery


def test_it_is_a_closed_oriented_surface_of_genus_zero():
    mesh = hemi_ellipsoid(600)
    double = doubled(mesh)
    V = double.on_both(mesh.V)
    V[mesh.n :, 2] *= -1  # the mirror copy of what rises over the plane of its boundary
    closed = TriangleMesh.from_arrays(V, double.F)
    assert not closed.notices  # nothing had to be turned over
    assert not closed.loops
    assert euler_characteristic(double.F, double.size) == 2


def test_the_copies_share_their_boundary_and_nothing_else():
    mesh = hemi_ellipsoid(600)
    double = doubled(mesh)
    assert double.size == 2 * mesh.n - len(mesh.boundary)
    np.testing.assert_array_equal(double.F[: mesh.m], mesh.F)
    np.testing.assert_array_equal(double.mirror[mesh.boundary], mesh.boundary)
    copies = double.mirror[mesh.interior]
    np.testing.assert_array_equal(copies, np.arange(mesh.n, double.size))
    np.testing.assert_array_equal(double.F[mesh.m :, ::-1], double.mirror[mesh.F])


def test_values_are_the_same_on_both():
    mesh = hemi_ellipsoid(600)
    double = doubled(mesh)
    both = double.on_both(mesh.V)
    np.testing.assert_array_equal(both[: mesh.n], mesh.V)
    np.testing.assert_array_equal(both[double.mirror], mesh.V)


def test_its_laplacian_is_that_of_its_triangles():
    for mesh in (hemi_ellipsoid(600), DiskMesh.from_arrays(*gallery.flat_rectangle())):
        double = doubled(mesh)
        found = doubled_laplacian(laplacian(mesh), double)
        expected = cotangent_laplacian(double.on_both(mesh.V), double.F)
        assert abs(found - expected).max() < 1e-13


def test_a_chord_is_kept_though_it_then_has_four_triangles():
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 3))
    double = doubled(strip)
    assert double.size == strip.n
    assert len(repeated_half_edges(double.F))
    found = doubled_laplacian(laplacian(strip), double)
    assert abs(found - 2 * laplacian(strip)).max() < 1e-13
