import igl
import numpy as np
import pytest
from cembench.algorithms.lscm import lscm
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed
from cembench.conformal.metrics import all_metrics


def test_it_is_the_field_s_map_up_to_scale():
    mesh = hemi_ellipsoid(3000, x=2.0)
    result = lscm(mesh)
    pins = np.array(result.extras["pins"])
    UV, _ = igl.lscm(mesh.V, mesh.F, pins, np.array([[-1.0, 0.0], [1.0, 0.0]]))
    uv = UV[:, 0] + 1j * UV[:, 1]
    scale = abs(result.uv[pins[0]] - result.uv[pins[1]]) / 2
    assert abs(result.uv - scale * uv).max() < 1e-9


def test_the_image_has_area_pi_and_no_map_has_less_energy():
    mesh = hemi_ellipsoid(3000, x=2.0)
    uv = lscm(mesh).uv
    metrics = all_metrics(mesh, uv)
    assert metrics["image_area"] == pytest.approx(np.pi)
    rng = np.random.default_rng(0)
    pins = lscm(mesh).extras["pins"]
    for _ in range(5):
        step = 1e-3 * (rng.standard_normal(mesh.n) + 1j * rng.standard_normal(mesh.n))
        step[pins] = 0
        assert all_metrics(mesh, uv + step)["conformal_energy"] > metrics["conformal_energy"]


def test_a_flat_surface_comes_out_as_it_is():
    mesh = flat_disk(600, stretch=2.0)
    metrics = all_metrics(mesh, lscm(mesh).uv)
    assert abs(metrics["conformal_energy"]) < 1e-12
    assert metrics["angle_error_mean_deg"] < 1e-9


def test_a_collapsed_image_is_a_failure(monkeypatch):
    monkeypatch.setattr("cembench.conformal.free_boundary.polygon_area", lambda loop: 0.0)
    with pytest.raises(AlgorithmFailed, match="not positive: the map has collapsed"):
        lscm(hemi_ellipsoid(100))
