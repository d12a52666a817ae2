import numpy as np
import pytest

from cembench.geometry.planar import backward_arcs, fitted_circle, polygon_area, signed_areas


def ring(k=12):
    return np.exp(2j * np.pi * np.arange(k) / k)


def test_area_of_a_polygon_has_a_sign_and_no_origin():
    exact = 6 * np.sin(2 * np.pi / 12)
    assert polygon_area(ring()) == pytest.approx(exact)
    assert polygon_area(ring()[::-1]) == pytest.approx(-exact)
    assert polygon_area(ring() + 1e6) == pytest.approx(exact, rel=1e-9)


def test_signed_areas():
    z = np.array([0, 1, 1j, 1 + 1j])
    np.testing.assert_allclose(signed_areas(z, np.array([[0, 1, 2], [1, 2, 3]])), [0.5, -0.5])


@pytest.mark.parametrize(("centre", "radius"), [(0, 1), (3 - 4j, 1e-6), (1e3, 50.0)])
def test_the_circle_through_points_of_a_circle(centre, radius):
    c, r = fitted_circle(centre + radius * ring(7)[:5])
    assert abs(c - centre) < 1e-9 * max(abs(centre), radius)
    assert r == pytest.approx(radius, rel=1e-6)


def test_points_that_determine_no_circle():
    assert np.isnan(fitted_circle(np.zeros(4, complex))[1])
    assert np.isnan(fitted_circle(np.arange(4) + 0j)[1])


def test_arcs_that_run_backwards():
    z = ring()
    assert backward_arcs(z) == 0
    assert backward_arcs(z[::-1]) == 12
    z[[3, 4]] = z[[4, 3]]
    assert backward_arcs(z) == 1
