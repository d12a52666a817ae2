import numpy as np
import pytest

from cembench import AlgorithmFailed
from cembench.conformal.balancing import moebius_centred
from cembench.conformal.stereographic import to_plane, to_sphere


@pytest.fixture
def lopsided():
    rng = np.random.default_rng(0)
    z = 0.01 * (rng.standard_normal(400) + 1j * rng.standard_normal(400))
    return to_sphere(z, "south"), rng.random(400)


def test_the_centre_comes_to_the_origin_on_the_sphere(lopsided):
    S, mass = lopsided
    assert np.linalg.norm(mass @ S) / mass.sum() > 0.99
    centred = moebius_centred(S, mass)
    assert np.linalg.norm(mass @ centred) / mass.sum() < 1e-12
    np.testing.assert_allclose(np.linalg.norm(centred, axis=1), 1, rtol=1e-14)


def test_it_is_a_moebius_map(lopsided):
    S, mass = lopsided
    before, after = to_plane(S, "south"), to_plane(moebius_centred(S, mass), "south")

    def cross_ratio(z):
        a, b, c, d = z[:100], z[100:200], z[200:300], z[300:]
        return (a - c) * (b - d) / ((a - d) * (b - c))

    np.testing.assert_allclose(cross_ratio(after), cross_ratio(before), rtol=1e-6)


def test_a_point_with_most_of_the_mass_cannot_be_centred():
    S = to_sphere(np.array([0, 1, 1j, -1]), "south")
    with pytest.raises(AlgorithmFailed, match="cannot be centred"):
        moebius_centred(S, np.array([10.0, 1.0, 1.0, 1.0]))


def test_a_map_to_one_point_cannot_be_centred():
    S = np.tile([0.0, 0.0, 1.0], (5, 1))
    with pytest.raises(AlgorithmFailed, match="cannot be centred"):
        moebius_centred(S, np.ones(5))
