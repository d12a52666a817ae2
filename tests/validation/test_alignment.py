import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.conformal.moebius import Moebius
from cembench.validation.alignment import closest_moebius, distance

POINTS = flat_disk(600).V @ np.array([1, 1j, 0])
RING = POINTS[np.abs(POINTS) > 0.4]


@pytest.mark.parametrize(
    "moebius",
    [
        Moebius(1, 0, 0, 1),
        Moebius(np.exp(1j), -0.5, -0.5 * np.exp(1j), 1),
        Moebius(2j, 3, 0.1, 1),
    ],
)
def test_a_moebius_map_is_found_again(moebius):
    assert distance(POINTS, moebius(POINTS), moebius=True) < 1e-12
    found = closest_moebius(POINTS, moebius(POINTS))
    assert found(np.array([0.3j])) == pytest.approx(moebius(np.array([0.3j])))


def test_a_ring_turned_inside_out_is_the_same_map():
    assert distance(RING, 0.4 / RING, moebius=True) < 1e-12
    assert distance(RING, 0.4 / RING, moebius=False) > 0.1


def test_a_similarity_is_one_of_a_free_boundary():
    assert distance(POINTS, (2 - 1j) * POINTS + 5, moebius=False) < 1e-12


@pytest.mark.parametrize("off", [1e-3, 1e-2])
def test_the_distance_is_that_of_what_no_moebius_map_explains(off):
    wave = off * np.cos(40 * POINTS.real)
    expected = np.sqrt((np.abs(wave) ** 2).mean() / (np.abs(POINTS - POINTS.mean()) ** 2).mean())
    assert distance(POINTS, POINTS + wave, moebius=True) == pytest.approx(expected, rel=0.05)


def test_a_mirrored_map_is_another():
    assert distance(POINTS, np.conj(POINTS), moebius=True) > 0.5
