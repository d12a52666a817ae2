import numpy as np
import pytest

import cembench
from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.metrics import angle_errors, flipped_triangles


def moebius(z, a):
    return (z - a) / (1 - np.conj(a) * z)


@pytest.fixture(scope="module")
def mapped():
    mesh = cembench.surface("hemi-ellipsoid", 2000)
    return mesh, cembench.parameterize(mesh, "direct-cem").z


@pytest.mark.parametrize("away", [0.5, 0.4j - 0.3])
def test_a_map_that_was_moved_off_its_gauge_is_brought_back(mapped, away):
    mesh, uv = mapped
    moved = moebius(uv, away)
    before, own, after = (
        angle_errors(mesh, z).mean() for z in (moved, uv, angle_gauge(mesh, moved))
    )
    assert before > 1.05 * own
    assert after < 1.002 * own


def test_the_boundary_stays_on_the_circle_in_order_and_nothing_folds(mapped):
    mesh, uv = mapped
    moved = angle_gauge(mesh, moebius(uv, 0.6))
    around = moved[mesh.boundary]
    assert np.abs(np.abs(around) - 1).max() < 1e-15
    assert (np.angle(np.roll(around, -1) / around) > 0).all()
    assert not flipped_triangles(mesh, moved)


def test_a_map_in_its_best_gauge_is_returned_as_it_is(mapped):
    mesh, uv = mapped
    best = angle_gauge(mesh, uv)
    assert angle_errors(mesh, best).mean() <= angle_errors(mesh, uv).mean()
    again = angle_gauge(mesh, best)
    assert angle_errors(mesh, again).mean() > (1 - 1e-3) * angle_errors(mesh, best).mean()
