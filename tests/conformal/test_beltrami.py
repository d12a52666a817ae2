import numpy as np
import pytest
from cembench.surfaces.disk_grid import disk_grid
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench import AlgorithmFailed
from cembench.conformal.beltrami import (
    beltrami_coefficients,
    generalised_weights,
    linear_beltrami_solver,
    unfolded,
    weights_of_map,
)
from cembench.conformal.laplacian import half_cotangents


@pytest.fixture
def disk():
    return disk_grid(600)


def in_plane(z):
    return np.stack([z.real, z.imag], axis=1)


def ring(z):
    return np.flatnonzero(np.abs(z) > 1 - 1e-9)


def by_gradients(z, F, mu):
    """div(A grad) assembled triangle by triangle from the gradients of the hat functions."""
    K = sparse.lil_array((len(z), len(z)))
    for face, m in zip(F, mu, strict=True):
        d = 1 - abs(m) ** 2
        A = np.array(
            [[abs(1 - m) ** 2 / d, -2 * m.imag / d], [-2 * m.imag / d, abs(1 + m) ** 2 / d]]
        )
        P = np.column_stack([np.ones(3), in_plane(z[face])])
        gradients = np.linalg.inv(P)[1:]
        area = abs(np.linalg.det(P)) / 2
        for i in range(3):
            for j in range(3):
                K[face[i], face[j]] += area * gradients[:, i] @ A @ gradients[:, j]
    return K.toarray()


def test_the_weights_are_those_of_the_stiffness_matrix(disk):
    z, F = disk
    F = F[:60]
    rng = np.random.default_rng(0)
    mu = 0.9 * np.sqrt(rng.random(len(F))) * np.exp(2j * np.pi * rng.random(len(F)))
    K = by_gradients(z, F, mu)
    w = generalised_weights(z, F, mu)
    slow = np.zeros_like(K)
    for face, weights in zip(F, w, strict=True):
        for c in range(3):
            i, j = face[(c + 1) % 3], face[(c + 2) % 3]
            slow[i, j] -= weights[c]
            slow[j, i] -= weights[c]
            slow[i, i] += weights[c]
            slow[j, j] += weights[c]
    np.testing.assert_allclose(slow, K, atol=1e-11)


def test_without_distortion_they_are_half_cotangents(disk):
    z, F = disk
    weights = generalised_weights(z, F, np.zeros(len(F), complex))
    np.testing.assert_allclose(weights, half_cotangents(in_plane(z), F), atol=1e-12)


def test_those_of_a_map_are_the_surface_s_own_however_it_folds():
    mesh = hemi_ellipsoid(600)
    rng = np.random.default_rng(1)
    z = rng.standard_normal(mesh.n) + 1j * rng.standard_normal(mesh.n)
    mu = beltrami_coefficients(z, mesh.F, mesh.V)
    assert (np.abs(mu) > 1).sum() > 100
    expected = half_cotangents(mesh.V, mesh.F)
    np.testing.assert_allclose(
        weights_of_map(z, mesh.F, mu, mesh.V), expected, rtol=1e-6, atol=1e-6
    )


def test_collapsed_triangles_take_the_surface_s_cotangents():
    mesh = hemi_ellipsoid(600)
    z = mesh.V[:, 0] + 0j  # all on a line
    mu = beltrami_coefficients(z, mesh.F, mesh.V)
    expected = half_cotangents(mesh.V, mesh.F)
    np.testing.assert_array_equal(weights_of_map(z, mesh.F, mu, mesh.V), expected)


def test_the_solver_reproduces_an_affine_map(disk):
    z, F = disk
    affine = (0.7 + 0.2j) + (1.3 - 0.4j) * z + (0.3 + 0.5j) * np.conj(z)
    mu = np.full(len(F), (0.3 + 0.5j) / (1.3 - 0.4j))
    b = ring(z)
    result = linear_beltrami_solver(F, generalised_weights(z, F, mu), b, affine[b])
    np.testing.assert_allclose(result, affine, atol=1e-12)


def test_the_solver_finds_a_map_from_its_coefficients(disk):
    # The coefficients of a piecewise linear map determine it, given its boundary.
    z, F = disk
    map_ = z + 0.1 * np.exp(z.real) * np.conj(z) ** 2
    mu = beltrami_coefficients(z, F, in_plane(map_))
    assert np.abs(mu).max() < 1
    b = ring(z)
    result = linear_beltrami_solver(F, generalised_weights(z, F, mu), b, map_[b])
    assert np.abs(beltrami_coefficients(z, F, in_plane(result)) - mu).max() < 0.05
    assert np.abs(result - map_).max() < 0.01


def test_an_unfolded_coefficient_is_that_of_the_triangle_turned_over(disk):
    z, F = disk
    affine = 0.3 * z + np.conj(z)
    back = beltrami_coefficients(affine, F, in_plane(z))
    assert (np.abs(back) > 1).all()
    turned = beltrami_coefficients(np.conj(affine), F, in_plane(z))
    np.testing.assert_allclose(np.abs(unfolded(back)), np.abs(turned), rtol=1e-12)


def test_the_solver_refuses_collapsed_triangles(disk):
    z, F = disk
    z = z.copy()
    z[F[5]] = 1.0
    weights = generalised_weights(z, F, np.zeros(len(F), complex))
    with pytest.raises(AlgorithmFailed, match=r"\d+ of \d+ triangles have collapsed"):
        linear_beltrami_solver(F, weights, ring(z), z[ring(z)])
