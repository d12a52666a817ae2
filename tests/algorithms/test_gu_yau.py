from itertools import pairwise

import pytest
from cembench.algorithms.gu_yau import gu_yau
from cembench.algorithms.qiem import qiem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.metrics import all_metrics


def test_the_energy_falls_towards_that_of_implicit_steps():
    mesh = hemi_ellipsoid(300, x=1.5)
    result = gu_yau(mesh, tolerance=0, max_iterations=3000)
    history = result.energy_history
    assert all(after <= before for before, after in pairwise(history))
    limit = qiem(mesh, tolerance=1e-9).energy_history[-1]
    assert history[-1] == pytest.approx(limit, rel=0.01)
    assert history[0] > 1.02 * limit


def test_it_says_that_it_was_stopped():
    mesh = hemi_ellipsoid(300, x=1.5)
    result = gu_yau(mesh, max_iterations=5)
    assert result.extras["stopped"] == "iterations"
    assert result.iterations == 5
    assert all_metrics(mesh, result.uv)["flipped_triangles"] == 0
    assert gu_yau(mesh, tolerance=1e-3).extras["stopped"] == "energy"
