import numpy as np
import pytest

import cembench
from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.metrics import angle_errors, flipped_triangles, surface_areas
from cembench.conformal.planar import signed_areas
from cembench.conformal.texel_density import texel_density_ratio


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
    assert after < 1.01 * own


def test_the_boundary_stays_on_the_circle_in_order_and_nothing_folds(mapped):
    mesh, uv = mapped
    moved = angle_gauge(mesh, moebius(uv, 0.6))
    around = moved[mesh.boundary]
    assert np.abs(np.abs(around) - 1).max() < 1e-15
    assert (np.angle(np.roll(around, -1) / around) > 0).all()
    assert not flipped_triangles(mesh, moved)


def test_of_gauges_with_equal_angle_errors_the_most_even_is_taken(mapped):
    mesh, uv = mapped
    away = moebius(uv, 0.02)
    found = angle_gauge(mesh, away)
    errors = [angle_errors(mesh, z).mean() for z in (away, found)]
    ratios = [
        texel_density_ratio(surface_areas(mesh), signed_areas(z, mesh.F)) for z in (away, found)
    ]
    assert errors[1] < 1.01 * errors[0]
    assert ratios[1] < ratios[0]
