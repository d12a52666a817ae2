import numpy as np
import pytest

from cembench import AlgorithmFailed
from cembench.conformal.moebius import Moebius, three_point_map
from cembench.conformal.planar import fitted_circle


@pytest.fixture
def z():
    rng = np.random.default_rng(0)
    return rng.standard_normal(50) + 1j * rng.standard_normal(50)


def test_three_points_go_where_they_are_sent(z):
    p, q = z[:3], z[3:6]
    np.testing.assert_allclose(three_point_map(p, q)(p), q, rtol=1e-12)


def test_three_points_determine_the_map(z):
    known = Moebius(1 + 1j, 2, 0.3j, 1 - 0.5j)
    moebius = three_point_map(z[:3], known(z[:3]))
    np.testing.assert_allclose(moebius(z), known(z), rtol=1e-10)


def test_circles_stay_circles():
    circle = 2 + 1j + 3 * np.exp(2j * np.pi * np.arange(40) / 40)
    image = three_point_map(circle[[0, 10, 25]], [1, 1j, -1])(circle)
    centre, radius = fitted_circle(image)
    np.testing.assert_allclose(np.abs(image - centre), radius, rtol=1e-10)
    np.testing.assert_allclose(np.abs(image), 1, rtol=1e-10)


def test_the_inverse_undoes_it(z):
    m = Moebius(1 + 1j, 2, 0.3j, 1 - 0.5j)
    np.testing.assert_allclose(m.inverse(m(z)), z, rtol=1e-10)


def test_the_pole_goes_to_infinity():
    assert np.isinf(Moebius(1, 0, 1, -2)(np.array([2.0 + 0j])))[0]


@pytest.mark.parametrize("p", [[0, 0, 1], [0, 1, np.nan], [0, 1, np.inf]])
def test_points_that_determine_no_map_are_refused(p):
    with pytest.raises(AlgorithmFailed, match="three distinct finite points"):
        three_point_map(p, [0, 1, 1j])
