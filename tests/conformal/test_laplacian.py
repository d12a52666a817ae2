import igl
import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import DiskMesh
from cembench.conformal.laplacian import (
    cotangent_laplacian,
    half_cotangents,
    laplacian,
    non_delaunay_share,
)
from tests import gallery


def test_it_is_the_field_s_matrix_with_the_sign_turned():
    mesh = hemi_ellipsoid(3000)
    assert abs(laplacian(mesh) + igl.cotmatrix(mesh.V, mesh.F)).max() < 1e-12


def test_weights_of_a_right_angled_isosceles_triangle():
    V = np.array([[0, 0], [1, 0], [0, 1]], float)
    F = np.array([[0, 1, 2]])
    np.testing.assert_allclose(half_cotangents(V, F), [[0, 0.5, 0.5]], atol=1e-15)
    L = cotangent_laplacian(V, F).toarray()
    np.testing.assert_allclose(L, [[1, -0.5, -0.5], [-0.5, 0.5, 0], [-0.5, 0, 0.5]], atol=1e-15)


def test_plane_and_space_agree_and_linear_functions_are_harmonic():
    V, F = gallery.flat_rectangle()
    L = cotangent_laplacian(V, F)
    assert abs(L - cotangent_laplacian(V[:, :2], F)).max() < 1e-14
    mesh = DiskMesh.from_arrays(V, F)
    assert abs((L @ V)[mesh.interior]).max() < 1e-13
    assert abs(L.sum(axis=1)).max() < 1e-14
    assert abs(L - L.T).max() == 0


def test_intrinsic_delaunay_has_no_negative_weight_and_the_same_kernel():
    mesh = hemi_ellipsoid(3000, z=6.0)
    assert non_delaunay_share(mesh) > 0.04
    L = laplacian(mesh, delaunay=True)
    entries = L.tocoo()
    weights = entries.data[entries.row != entries.col]
    assert weights.max() < 1e-12
    assert abs(L.sum(axis=1)).max() < 1e-9


def test_share_of_edges_that_are_not_delaunay():
    """Sheared one way a grid is equilateral, the other way its diagonals face obtuse angles."""
    i, j, F = gallery.grid(20, 20)
    height = i * np.sqrt(3) / 2
    equilateral = DiskMesh.from_arrays(np.stack([j - i / 2, height, 0 * i], 1), F)
    sheared = DiskMesh.from_arrays(np.stack([j + i / 2, height, 0 * i], 1), F)
    assert non_delaunay_share(equilateral) == 0
    diagonals, interior_edges = 400, 400 + 2 * 19 * 20
    assert non_delaunay_share(sheared) == pytest.approx(diagonals / interior_edges)


def test_a_spherical_cap_is_delaunay():
    assert non_delaunay_share(spherical_cap(5000)) < 1e-3
