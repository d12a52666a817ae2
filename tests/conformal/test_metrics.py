from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cembench import DiskMesh, HoledMesh
from cembench.conformal import metrics
from cembench.conformal.metrics import (
    METRICS,
    SampledAngleError,
    all_metrics,
    angle_errors,
    boundary_circles,
    corner_angles,
    dilatations,
    lost_in_rounding,
    metrics_markdown,
)
from tests import gallery


def planar(mesh):
    return mesh.V[:, 0] + 1j * mesh.V[:, 1]


def test_a_flat_disk_maps_to_itself_without_any_distortion():
    mesh = flat_disk(600)
    metrics = all_metrics(mesh, planar(mesh))
    rim = len(mesh.boundary)
    assert metrics["image_area"] == pytest.approx(rim / 2 * np.sin(2 * np.pi / rim))
    assert metrics["dirichlet_energy"] == pytest.approx(metrics["image_area"], rel=1e-12)
    assert abs(metrics["conformal_energy"]) < 1e-12
    assert metrics["angle_error_mean_deg"] < 1e-10
    assert metrics["flipped_triangles"] == 0
    assert metrics["dilatation_max"] == pytest.approx(1, abs=1e-10)
    assert metrics["boundary_circularity"] < 1e-12


def test_a_stretched_square_in_closed_form():
    """(x, y) -> (s x, y) on the unit square has E_D = (s^2 + 1) / 2, A = s, K = s and
    E_C = (s - 1)^2 / 2; angles of 45, 90, 45 degrees become atan(1/s), 90, atan(s)."""
    i, j, F = gallery.grid(6, 6)
    mesh = DiskMesh.from_arrays(np.stack([j / 6, i / 6, 0 * i], 1), F)
    s = 3.0
    metrics = all_metrics(mesh, s * mesh.V[:, 0] + 1j * mesh.V[:, 1])
    assert metrics["dirichlet_energy"] == pytest.approx((s**2 + 1) / 2)
    assert metrics["image_area"] == pytest.approx(s)
    assert metrics["conformal_energy"] == pytest.approx((s - 1) ** 2 / 2)
    assert metrics["dilatation_mean"] == pytest.approx(s)
    assert metrics["dilatation_max"] == pytest.approx(s)
    off = 45 - np.rad2deg(np.arctan(1 / s))
    assert metrics["angle_error_mean_deg"] == pytest.approx(2 * off / 3)
    assert metrics["angle_error_sd_deg"] == pytest.approx(off * np.sqrt(2) / 3)
    # Fitted to a rectangle, the circle through nothing: far from circular, yet finite.
    assert 0.1 < metrics["boundary_circularity"] < 1


def test_a_folded_vertex_is_counted_and_a_collapsed_triangle_is_infinite():
    mesh = flat_disk(600)
    uv = planar(mesh)
    uv[0] = 5  # the middle vertex, outside the disk: some of its six triangles turn over
    metrics = all_metrics(mesh, uv)
    assert 0 < metrics["flipped_triangles"] < 6
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle())
    uv = planar(mesh)
    uv[8] = uv[7]  # an edge of two triangles becomes a point
    metrics = all_metrics(mesh, uv)
    assert metrics["flipped_triangles"] == 2
    assert metrics["dilatation_max"] == np.inf
    assert np.isfinite(metrics["angle_error_mean_deg"])


def test_a_mirror_image_is_all_flipped_and_as_conformal():
    mesh = flat_disk(600)
    metrics = all_metrics(mesh, np.conj(planar(mesh)))
    assert metrics["flipped_triangles"] == mesh.m
    assert metrics["image_area"] < 0
    assert metrics["angle_error_mean_deg"] < 1e-10


def test_angles_of_slivers_are_accurate():
    V = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]])
    angles = corner_angles(V, np.array([[0, 1, 2]]))[0]
    np.testing.assert_allclose(
        angles, [np.rad2deg(2e-9)] * 2 + [180 - 2 * np.rad2deg(2e-9)], rtol=1e-9
    )


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    scale=st.floats(1e-6, 1e6),
    shift=st.floats(-10, 10),
)
def test_figures_do_not_depend_on_pose_size_or_numbering(seed, scale, shift):
    rng = np.random.default_rng(seed)
    mesh = hemi_ellipsoid(150)
    uv = planar(mesh) / 2 + 0.005 * rng.standard_normal((mesh.n, 2)) @ [1, 1j]
    before = all_metrics(mesh, uv)
    numbers = rng.permutation(mesh.n)
    V = np.empty_like(mesh.V)
    V[numbers] = scale * Rotation.random(random_state=seed).apply(mesh.V + shift)
    moved = DiskMesh.from_arrays(V, np.roll(numbers[mesh.F], 1, axis=1)[rng.permutation(mesh.m)])
    moved_uv = np.empty_like(uv)
    moved_uv[numbers] = np.exp(1j * shift) * uv
    after = all_metrics(moved, moved_uv)
    for name, value in before.items():
        assert after[name] == pytest.approx(value, rel=1e-7, abs=1e-9), name
    assert before["conformal_energy"] >= 0
    assert (dilatations(mesh, uv) >= 1).all()
    assert (angle_errors(mesh, uv) >= 0).all()


def test_round_holes_are_found_with_centre_and_radius_and_leave_the_area():
    mesh = gallery.three_holes()
    uv = planar(mesh)
    outer, *holes = boundary_circles(mesh, uv)
    assert (outer.centre, outer.radius) == (pytest.approx(0, abs=1e-12), pytest.approx(1))
    expected = sorted(zip(*gallery.THREE_HOLES, strict=True), key=lambda hole: hole[1])
    for hole, (centre, radius) in zip(sorted(holes, key=lambda h: h.radius), expected, strict=True):
        assert hole.centre == pytest.approx(centre)
        assert hole.radius == pytest.approx(radius)
        assert hole.circularity < 1e-12
    polygons = [
        n / 2 * np.sin(2 * np.pi / n) * r**2
        for n, r in [(c.vertices, c.radius) for c in (outer, *holes)]
    ]
    metrics = all_metrics(mesh, uv)
    assert metrics["image_area"] == pytest.approx(polygons[0] - sum(polygons[1:]))
    assert abs(metrics["conformal_energy"]) < 1e-12


def test_circularity_of_an_ellipse_and_of_a_point():
    V, F = gallery.annulus(0.4)
    mesh = HoledMesh.from_arrays(V, F)
    uv = planar(mesh)
    hole = np.abs(uv) < 0.4 + 1e-9
    uv[hole] += 0.04 * np.conj(uv[hole]) / 0.4  # half axes 0.44 and 0.36 about a radius of 0.4
    outer, inner = boundary_circles(mesh, uv)
    assert outer.circularity < 1e-12
    assert inner.circularity == pytest.approx(0.1, rel=0.1)
    uv[hole] = 0
    assert boundary_circles(mesh, uv)[1].circularity == np.inf


def test_a_sample_of_the_angle_errors_is_the_mean_of_small_meshes_and_near_it_on_large_ones(
    monkeypatch,
):
    mesh = spherical_cap(6000)
    uv = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    mean = angle_errors(mesh, uv).mean()
    assert SampledAngleError(mesh)(uv) == pytest.approx(mean)
    monkeypatch.setattr(metrics, "SAMPLE", 500)
    assert SampledAngleError(mesh)(uv) != mean
    assert SampledAngleError(mesh)(uv) == pytest.approx(mean, rel=0.1)


def test_every_metric_says_how_it_is_shown():
    for metric in METRICS:
        assert metric.title
        assert metric.meaning
        assert "|" not in metric.meaning  # it goes into a Markdown table
        assert format(1, metric.form)
        assert format(1, metric.precise)
        assert metric.text(None) == "inf"


def test_a_record_holds_every_metric_of_the_table_in_its_order():
    mesh = flat_disk(60)
    metrics = all_metrics(mesh, mesh.V[:, 0] + 1j * mesh.V[:, 1])
    assert list(metrics) == [metric.name for metric in METRICS]


def test_the_page_of_metrics_has_their_table():
    page = Path(__file__).parents[2] / "docs/metrics.md"
    assert metrics_markdown() in page.read_text()


@pytest.mark.parametrize("thin", [1e-3, 1e-9, 1e-14])
def test_dilatations_of_slivers_are_those_of_the_stretch(thin):
    """A strip flattened by a factor, mapped to where it came from: 1 / thin everywhere."""
    V, F = gallery.flat_rectangle()
    mesh = DiskMesh.from_arrays(V * [1, thin, 1], F)
    dilatation = dilatations(mesh, V[:, 0] + 1j * V[:, 1])
    np.testing.assert_allclose(dilatation, 1 / thin, rtol=1e-9)
    np.testing.assert_allclose(dilatations(mesh, planar(mesh)), 1, rtol=1e-6)


def test_figures_that_rounding_has_eaten_are_named():
    sound = {"conformal_energy": 1e-3, "dirichlet_energy": 3.0, "dilatation_max": 2.0}
    assert lost_in_rounding(sound) == []
    assert lost_in_rounding(sound | {"conformal_energy": -1e-12}) == []
    (note,) = lost_in_rounding(sound | {"conformal_energy": -7.0})
    assert "conformal_energy is -7" in note.text
    notes = lost_in_rounding(sound | {"dilatation_max": np.inf, "conformal_energy": np.nan})
    assert [note.text.split()[0] for note in notes] == ["conformal_energy", "dilatation_max"]
