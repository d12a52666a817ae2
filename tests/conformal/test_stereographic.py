import numpy as np
import pytest

from cembench.conformal.stereographic import to_plane, to_sphere

POLES = ("north", "south")


@pytest.fixture
def points():
    S = np.random.default_rng(0).standard_normal((500, 3))
    return S / np.linalg.norm(S, axis=1, keepdims=True)


@pytest.mark.parametrize("pole", POLES)
def test_there_and_back(points, pole):
    np.testing.assert_allclose(to_sphere(to_plane(points, pole), pole), points, atol=1e-12)
    z = np.array([0, 1, 1j, -3 + 4j, 1e-9, 1e-300])
    np.testing.assert_allclose(to_plane(to_sphere(z, pole), pole), z, rtol=1e-12)


@pytest.mark.parametrize("pole", POLES)
def test_the_pole_is_infinity(pole):
    at = np.array([[0, 0, 1.0 if pole == "north" else -1.0]])
    assert np.isinf(to_plane(at, pole)).all()
    huge = np.array([complex(np.inf), 1e300, 1e200j])
    np.testing.assert_allclose(to_sphere(huge, pole), np.repeat(at, 3, axis=0), atol=1e-15)


def test_the_equator_stays_and_the_poles_are_mirror_images(points):
    z = np.exp(1j * np.linspace(0, 6, 7))
    expected = np.stack([z.real, z.imag, 0 * z.real], axis=1)
    for pole in POLES:
        np.testing.assert_allclose(to_sphere(z, pole), expected, atol=1e-15)
    north, south = to_plane(points, "north"), to_plane(points, "south")
    np.testing.assert_allclose(south, 1 / np.conj(north), rtol=1e-11)


def test_only_the_south_pole_keeps_orientation():
    # Three points round the x axis, counter-clockwise seen from outside.
    angle = 2 * np.pi * np.arange(3) / 3
    S = np.stack([np.full(3, 0.9), 0.436 * np.cos(angle), 0.436 * np.sin(angle)], axis=1)
    for pole, sign in (("north", -1), ("south", 1)):
        a, b, c = to_plane(S, pole)
        assert np.sign(((b - a).conjugate() * (c - a)).imag) == sign
