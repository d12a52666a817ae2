import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from scipy import special

from cembench.conformal.resample import interpolated, locate, square_to_disk
from tests import gallery


@pytest.fixture(scope="module")
def cap():
    return gallery.mapped_cap()


def test_the_square_goes_to_the_disk_conformally():
    t = np.linspace(-1, 1, 41)
    for side in (t - 1j, t + 1j, -1 + 1j * t, 1 + 1j * t):
        np.testing.assert_allclose(np.abs(square_to_disk(side)), 1, atol=1e-7)
    corners = square_to_disk(np.array([1 + 1j, -1 + 1j]))
    np.testing.assert_allclose(corners, np.exp(1j * np.pi / 4 * np.array([1, 3])), atol=1e-7)
    assert square_to_disk(np.zeros(1))[0] == pytest.approx(0, abs=1e-12)
    w = 0.9 * (t[None, :] + 1j * t[:, None])
    step = 1e-5
    along = (square_to_disk(w + step) - square_to_disk(w - step)) / (2 * step)
    upwards = (square_to_disk(w + 1j * step) - square_to_disk(w - 1j * step)) / (2j * step)
    np.testing.assert_allclose(along, upwards, atol=1e-8)
    # The derivative of cn at K has modulus sqrt(1 - m), here of K (1 + i) w / 2.
    assert abs(along[20, 20]) == pytest.approx(special.ellipk(0.5) / 2, rel=1e-6)


def test_points_are_found_where_they_lie(cap):
    mesh, z = cap
    face, weights = locate(z, mesh.F, z[mesh.F].mean(axis=1))
    np.testing.assert_array_equal(face, np.arange(mesh.m))
    np.testing.assert_allclose(weights, 1 / 3, atol=1e-9)
    assert locate(z, mesh.F, np.array([2 + 0j]))[0][0] == -1
    _, weights = locate(z, mesh.F, np.array([2 + 0j]), nearest=True)
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1)


def test_vertices_are_found_where_they_are_and_linear_values_are_interpolated_exactly():
    mesh = flat_disk(600)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    face, weights = locate(z, mesh.F, z)
    np.testing.assert_allclose(interpolated(weights, mesh.V[mesh.F[face]]), mesh.V, atol=1e-9)
    points = 0.98 * np.sqrt(np.linspace(0, 1, 500)) * np.exp(40j * np.linspace(0, 1, 500))
    face, weights = locate(z, mesh.F, points)
    assert (weights >= 0).all()
    values = (3 * z.real - z.imag)[mesh.F[face]]
    found = interpolated(weights, values)
    np.testing.assert_allclose(found, 3 * points.real - points.imag, atol=1e-12)


def test_points_beyond_a_boundary_edge_come_to_its_chord():
    mesh = flat_disk(600)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    ends = z[mesh.boundary], np.roll(z[mesh.boundary], -1)
    middle = (ends[0] + ends[1]) / 2
    face, weights = locate(z, mesh.F, middle / np.abs(middle), nearest=True)
    np.testing.assert_allclose(interpolated(weights, z[mesh.F[face]]), middle, atol=1e-9)
    assert (locate(z, mesh.F, middle / np.abs(middle))[0] == -1).all()
