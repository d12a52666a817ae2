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
from cembench import DiskMesh, HoledMesh
from cembench.conformal.certificate import certify, certify_holes, disk_modulus, four_points
from cembench.conformal.circle_capacities import circle_capacities
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
    certificate = certify(mesh, corner)
    assert certificate.upper == pytest.approx(2.5, rel=1e-12)
    assert certificate.conjugate == pytest.approx(1 / 2.5, rel=1e-12)
    assert abs(certificate.reciprocal_error) < 1e-12


def test_a_quarter_of_a_ring_has_the_modulus_of_its_logarithm():
    """z -> log z takes it to a rectangle of pi / 2 by log 2; nothing is singular: second order."""
    errors, gaps = [], []
    for n in (6, 12, 24):
        i, j, F = gallery.grid(n, n)
        z = 2 ** (j / n) * np.exp(0.5j * np.pi * i / n)
        mesh = DiskMesh.from_arrays(np.stack([z.real, z.imag, 0 * j], 1), F)
        corner = np.array([0, n, (n + 1) ** 2 - 1, n * (n + 1)])
        certificate = certify(mesh, corner)
        errors.append(abs(certificate.modulus / (np.log(2) / (np.pi / 2)) - 1))
        gaps.append(certificate.reciprocal_error)
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
        certificate = certify(mesh, corner)
        gaps.append(certificate.reciprocal_error)
        errors.append(abs(disk_modulus(exact / np.abs(exact)) / certificate.modulus - 1))
        assert certificate.lower < disk_modulus(exact / np.abs(exact)) < certificate.upper
    # The potential has the root of the distance at each corner: first order.
    np.testing.assert_allclose(np.log2(np.array(gaps[:-1]) / gaps[1:]), 1, atol=0.2)
    assert errors[2] < errors[0] / 3


def test_a_map_that_is_not_conformal_is_found_out_where_angles_are_few():
    mesh = hemi_ellipsoid(6144)
    certificate = certify(mesh)
    good, bad = (mapped(mesh).uv[certificate.corners] for mapped in (direct_cem, harmonic_circle))
    assert abs(certificate.off(good)) < 1e-3
    assert certificate.encloses(good)
    assert abs(certificate.off(bad)) > 0.02
    assert not certificate.encloses(bad)


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


def test_the_capacity_of_a_ring_is_enclosed_and_the_bounds_close_at_second_order():
    """Its map to the annulus has log(1 / r) = 2 pi / C = 1."""
    widths, errors = [], []
    for faces in (500, 8000):
        certificate = certify_holes(cembench.surface("catenoid-ring", faces))
        middle = np.sqrt(certificate.lower[0, 0] * certificate.upper[0, 0])
        widths.append(certificate.reciprocal_error)
        errors.append(abs(middle / (2 * np.pi) - 1))
    for fell in (widths, errors):
        assert fell[0] > 0
        assert np.log2(fell[0] / fell[1]) / 2 == pytest.approx(2, abs=0.3)


def test_bounds_of_several_holes_enclose_each_other_and_close():
    """On finer meshes of the same domain both bounds move towards each other."""
    V, F = gallery.disk_with_holes(*gallery.THREE_HOLES, 600)
    coarse = certify_holes(HoledMesh.from_arrays(V, F))
    fine = certify_holes(HoledMesh.from_arrays(*split(V, F)))
    order = np.linalg.eigvalsh
    assert order(coarse.upper - fine.upper).min() > -1e-12
    assert order(fine.upper - fine.lower).min() > 0
    assert order(fine.lower - coarse.lower).min() > -1e-12
    assert fine.reciprocal_error < 0.5 * coarse.reciprocal_error


def split(V, F):
    """Split every triangle into four: another mesh of the same surface."""
    edges = np.sort(np.concatenate([F[:, [1, 2]], F[:, [2, 0]], F[:, [0, 1]]]), axis=1)
    ends, number = np.unique(edges, axis=0, return_inverse=True)
    a, b, c = len(V) + number.reshape(3, -1)
    i, j, k = F.T
    parts = [(i, c, b), (c, j, a), (b, a, k), (a, b, c)]
    fine = np.concatenate([np.stack(part, axis=1) for part in parts])
    return np.concatenate([V, V[ends].mean(axis=1)]), fine


@pytest.mark.parametrize("shift", [0.0, 0.03])
def test_circles_that_are_not_the_surface_s_are_found_out(shift):
    """A map that moves one hole of a plane domain keeps circles, but is not conformal."""
    mesh = gallery.three_holes(5000)
    certificate = certify_holes(mesh)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    centre, radius = (some[0] for some in gallery.THREE_HOLES)
    far = np.abs(z - centre)
    moved = z + shift * np.clip((radius + 0.15 - far) / 0.15, 0, 1)
    least, most = certificate.off(moved[certificate.corners])
    assert certificate.encloses(moved[certificate.corners]) == (shift == 0)
    assert least <= most < 0.1 + 10 * shift
    words = certificate.words(moved[certificate.corners])
    told = "these circles may be" if shift == 0 else f"at least {least:.2%}. The bounds"
    assert told in words
    # No smaller dilatation does: K of the shear is a bound that this bound does not exceed.
    assert least < (1 + shift / 0.15) / (1 - shift / 0.15) - 1 + 1e-9


def test_circles_are_compared_up_to_moebius_maps_and_polygons_are_refused():
    result = cembench.parameterize(gallery.three_holes(1200), target="disk")
    proof = result.certificate()
    z = result.z[proof.corners]
    moved = Moebius(1, -0.3j, 0.3j, 1)(z)
    np.testing.assert_allclose(proof.off(moved), proof.off(z), atol=1e-7)
    assert proof.encloses(z)
    z[0] *= 1.01
    with pytest.raises(AlgorithmFailed, match=r"hole with vertex \d+ is off a circle"):
        proof.words(z)


@pytest.mark.parametrize("radius", [0.5, 1e-200])
def test_the_capacity_of_a_round_hole_is_known(radius):
    C, error = circle_capacities(np.array([0j]), np.array([radius]))
    assert C[0, 0] == pytest.approx(2 * np.pi / np.log(1 / radius), rel=1e-12)
    assert error < 1e-12


def test_equal_circles_around_the_middle_have_the_capacity_of_one_in_its_power():
    """z -> z^n takes n discs about the roots of c to one preimage: with all at 1, n times as much.

    For discs that are circles after the power, the sum of all capacities is n times that of the one
    hole; small ones are, to first order in their radius.
    """
    n, r = 5, 1e-3
    C, _ = circle_capacities(0.6 * np.exp(2j * np.pi * np.arange(n) / n), np.full(n, r))
    one, _ = circle_capacities(np.array([0.6**n + 0j]), np.array([n * 0.6 ** (n - 1) * r]))
    assert C.sum() == pytest.approx(n * one[0, 0], rel=1e-4)
    np.testing.assert_allclose(C, np.roll(C, (1, 1), axis=(0, 1)), rtol=1e-7)
    assert (C - np.diag(np.diag(C)) <= 0).all()


def test_circles_that_meet_bound_no_domain():
    for centres, radii in (([0.3, -0.3], [0.3, 0.31]), ([0.5], [0.5])):
        with pytest.raises(AlgorithmFailed, match="circles of the map meet"):
            circle_capacities(np.array(centres, complex), np.array(radii))
