"""The modulus of a quadrilateral: enclosed on a mesh, exact in the disk."""

import numpy as np
import pytest
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.harmonic_circle import harmonic_circle
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap
from scipy import integrate

import cembench
from cembench import DiskMesh
from cembench.conformal.certificate import certify, certify_ring, disk_modulus, four_points
from cembench.conformal.moebius import Moebius
from cembench.core.errors import AlgorithmFailed
from tests import gallery


def rectangle(rows, columns, width):
    i, j, F = gallery.grid(rows, columns)
    x, y = width * j / columns, i / rows
    x = x + 0.1 * np.sin(2 * np.pi * x / width) * np.sin(np.pi * y)  # inside, and along its sides
    mesh = DiskMesh.from_arrays(np.stack([x, y, 0 * i], 1), F)
    corner = np.array([0, columns, (rows + 1) * (columns + 1) - 1, rows * (columns + 1)])
    return mesh, corner


def test_a_rectangle_has_the_modulus_width_over_height_exactly():
    mesh, corner = rectangle(5, 8, width=2.5)
    found = certify(mesh, corner)
    assert found.upper == pytest.approx(2.5, rel=1e-12)
    assert found.conjugate == pytest.approx(1 / 2.5, rel=1e-12)
    assert abs(found.reciprocal_error) < 1e-12


def test_a_quarter_of_a_ring_has_the_modulus_of_its_logarithm():
    """z -> log z takes it to a rectangle of pi / 2 by log 2; nothing is singular: second order."""
    errors, gaps = [], []
    for n in (6, 12, 24):
        i, j, F = gallery.grid(n, n)
        z = 2 ** (j / n) * np.exp(0.5j * np.pi * i / n)
        mesh = DiskMesh.from_arrays(np.stack([z.real, z.imag, 0 * j], 1), F)
        corner = np.array([0, n, (n + 1) ** 2 - 1, n * (n + 1)])
        found = certify(mesh, corner)
        errors.append(abs(found.modulus / (np.log(2) / (np.pi / 2)) - 1))
        gaps.append(found.reciprocal_error)
    for fell in (errors, gaps):
        np.testing.assert_allclose(np.log2(np.array(fell[:-1]) / fell[1:]), 2, atol=0.15)


@pytest.mark.parametrize("angles", [(0.0, 1.6, 3.1, 4.8), (0.0, 0.5, 3.0, 3.3), (0, 0.02, 0.1, 3)])
def test_the_disk_s_modulus_by_its_schwarz_christoffel_rectangle(angles):
    """Sides of the rectangle by quadrature of prod |z - z_k|^(-1/2) along the circle."""
    z = np.exp(1j * np.array(angles))

    def side(start, end, ends):
        others = [w for w in z if not any(np.isclose(w, e) for e in ends)]

        def speed(t):
            return np.prod([abs(np.exp(1j * t) - w) for w in others]) ** -0.5 * rest(t)

        def rest(t):
            # |e^it - e^ia| |e^it - e^ib| without (t - a)(b - t), which quad weighs.
            return (
                (2 * np.sinc((t - start) / 2 / np.pi) / 2)
                * (2 * np.sinc((end - t) / 2 / np.pi) / 2)
            ) ** -0.5

        return integrate.quad(speed, start, end, weight="alg", wvar=(-0.5, -0.5))[0]

    lengths = [side(angles[0], angles[1], z[:2]), side(angles[1], angles[2], z[1:3])]
    assert disk_modulus(z) == pytest.approx(lengths[0] / lengths[1], rel=1e-7)


def test_the_disk_s_modulus_is_moebius_invariant_and_1_for_a_square():
    z = np.exp(1j * np.array([0.1, 0.9, 2.5, 4.0]))
    moved = Moebius(1, -0.8j, 0.8j, 1)(z)
    assert disk_modulus(moved) == pytest.approx(disk_modulus(z), rel=1e-12)
    assert disk_modulus(np.roll(z, -1)) == pytest.approx(1 / disk_modulus(z), rel=1e-12)
    assert disk_modulus(np.array([1, 1j, -1, -1j])) == pytest.approx(1)
    assert np.isnan(disk_modulus(z[::-1]))
    assert np.isnan(disk_modulus(z[[0, 2, 1, 3]]))


def test_the_modulus_of_a_cap_is_that_of_its_boundary_angles():
    """A stereographic map keeps the angles of the boundary: its four points are known."""
    errors, gaps = [], []
    for faces in (600, 2400, 9600):
        mesh = spherical_cap(faces)
        loop, n = mesh.boundary, len(mesh.boundary)
        corner = loop[[0, n // 6, n // 2, 3 * n // 4]]
        exact = mesh.V[corner, 0] + 1j * mesh.V[corner, 1]
        found = certify(mesh, corner)
        gaps.append(found.reciprocal_error)
        errors.append(abs(disk_modulus(exact / np.abs(exact)) / found.modulus - 1))
        assert found.lower < disk_modulus(exact / np.abs(exact)) < found.upper
    # The potential has the root of the distance at each corner: first order.
    np.testing.assert_allclose(np.log2(np.array(gaps[:-1]) / gaps[1:]), 1, atol=0.2)
    assert errors[2] < errors[0] / 3


def test_a_map_that_is_not_conformal_is_found_out_where_angles_are_few():
    mesh = hemi_ellipsoid(6144)
    found = certify(mesh)
    good, bad = (mapped(mesh).uv[found.corners] for mapped in (direct_cem, harmonic_circle))
    assert abs(found.off(good)) < 1e-3
    assert found.encloses(good)
    assert abs(found.off(bad)) > 0.02
    assert not found.encloses(bad)


def test_points_that_are_no_quadrilateral_are_refused():
    mesh = flat_disk(600)
    a, b, c, d = four_points(mesh)
    for wrong in ([a, c, b, d], [a, b, c], [a, b, b, d], [a, b, c, int(mesh.interior[0])]):
        with pytest.raises(AlgorithmFailed, match="four boundary vertices"):
            certify(mesh, np.array(wrong))
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    with pytest.raises(AlgorithmFailed, match="four are needed"):
        certify(DiskMesh.from_arrays(V, np.array([[0, 1, 2]])))


def test_the_four_points_follow_the_geometry_and_are_apart():
    mesh = flat_disk(600, stretch=2.0)
    again = DiskMesh.from_arrays(mesh.V, np.roll(mesh.F[::-1], 1, axis=1))
    assert set(four_points(mesh)) == set(four_points(again))
    i, j, F = gallery.grid(1, 1)
    square = DiskMesh.from_arrays(np.stack([9 * j, i, 0 * i], 1).astype(float), F)
    assert len(set(four_points(square))) == 4
    assert certify(square, np.array([0, 1, 3, 2])).upper == pytest.approx(9)


def test_a_ring_s_modulus_is_enclosed_and_the_bounds_close_at_second_order():
    widths = []
    for faces in (500, 8000):
        ring = cembench.surface("catenoid-ring", faces)
        found = certify_ring(ring)
        assert found.lower < found.upper
        assert found.modulus == pytest.approx(1 / (2 * np.pi), rel=0.01)
        widths.append(found.reciprocal_error)
    assert np.log2(widths[0] / widths[1]) / 2 == pytest.approx(2, abs=0.3)


def test_a_ring_s_map_is_compared_whatever_its_centre_and_several_holes_have_no_bounds():
    result = cembench.parameterize(cembench.surface("catenoid-ring", 2000))
    proof = result.certificate()
    assert abs(proof.off(result.z[proof.corners])) < 0.005
    assert "off" in proof.words(result.z[proof.corners])
    circle = np.exp(2j * np.pi * np.arange(12) / 12)
    moved = (0.4 * circle - 0.3) / (1 - 0.3 * 0.4 * circle)
    assert proof.of_map(moved) == pytest.approx(proof.of_map(0.4 * circle))
    with pytest.raises(AlgorithmFailed, match="3 holes"):
        certify_ring(gallery.three_holes())
