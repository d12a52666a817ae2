import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import HoledMesh
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.laplacian import cotangent_laplacian
from cembench.conformal.patches import disk_patch, fan_patch, filled, sum_of_cosines
from tests import gallery


def uneven_angles(k=200, seed=3):
    return np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, k))


def test_the_sum_of_cosines_agrees_with_its_terms():
    x = np.linspace(-7, 7, 29)
    k = np.arange(1, 100_001)[:, None]
    np.testing.assert_allclose(
        sum_of_cosines(x), ((np.cos(k * x) - 1) / k**3).sum(axis=0), atol=1e-9
    )


def test_a_disks_energy_of_a_fourier_mode_approaches_pi_times_its_number_at_second_order():
    """Half of u^T P u is the Dirichlet energy of r^m cos(m t), pi m / 2."""
    errors = []
    for k in (100, 200, 400):
        t = 2 * np.pi * (np.arange(k) + 0.3 * np.sin(np.arange(k))) / k
        P = disk_patch(t)
        errors.append([abs(np.cos(m * t) @ P @ np.cos(m * t) / (np.pi * m) - 1) for m in (1, 2, 5)])
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    print(rates)
    assert (rates > 1.9).all()


def test_a_patch_is_symmetric_semidefinite_and_does_not_feel_constants():
    rng = np.random.default_rng(1)
    for P in (disk_patch(uneven_angles(40)), fan_patch(rng.normal(size=(17, 3)))):
        scale = abs(P).max()
        np.testing.assert_allclose(P, P.T, atol=1e-9 * scale)
        np.testing.assert_allclose(P.sum(axis=1), 0, atol=1e-9 * scale)
        values = np.linalg.eigvalsh(P)
        assert values[0] > -1e-9 * scale
        assert values[1] > 1e-6


def test_a_disk_patch_is_what_a_fine_triangulation_of_the_disk_condenses_to():
    mesh = flat_disk(4000)
    rim = mesh.boundary
    S = BorderedLaplacian(mesh, cotangent_laplacian(mesh.V, mesh.F), [rim]).S
    t = np.unwrap(np.angle(mesh.V[rim, 0] + 1j * mesh.V[rim, 1]))
    P = disk_patch(t)
    for m in (1, 2, 3):
        assert np.cos(m * t) @ S @ np.cos(m * t) == pytest.approx(
            np.cos(m * t) @ P @ np.cos(m * t), rel=0.01
        )


def test_crowded_angles_lose_no_definiteness():
    t = uneven_angles(50)
    t[20:25] = t[20] + 1e-7 * np.arange(5)
    P = disk_patch(t)
    assert np.linalg.eigvalsh(P / np.sqrt(np.outer(P.diagonal(), P.diagonal())))[0] > -1e-6


def test_a_fan_is_its_triangles_with_the_centre_eliminated():
    rim = np.exp(2j * np.pi * np.arange(6) / 6)[::-1]  # holes run clockwise
    P = fan_patch(np.stack([rim.real, rim.imag], axis=1))
    # Equilateral triangles: each edge of the rim counts cot 60 / 2, each spoke cot 60.
    w = 1 / np.sqrt(3)
    expected = 2 * w * np.eye(6) - w / 2 * (np.roll(np.eye(6), 1, 0) + np.roll(np.eye(6), -1, 0))
    np.testing.assert_allclose(P, expected - w / 6, atol=1e-12)


def test_a_fan_whose_centre_lies_on_its_rim_counts_all_edges_alike():
    rim = np.array([[0, 0], [2, 0], [2, 2], [1, 0.8], [0, 2]]) * 1.0
    rim[3] = rim[[0, 1, 2, 4]].mean(axis=0) * [1, 1]
    rim -= rim.mean(axis=0)
    assert np.isfinite(fan_patch(rim)).all()


def test_a_hole_of_three_vertices_is_filled_like_any_other():
    disk = flat_disk(600)
    F = np.delete(disk.F, np.flatnonzero((disk.F == 0).any(axis=1))[0], axis=0)
    mesh = HoledMesh.from_arrays(disk.V, F)
    _, (hole,) = mesh.outer_and_holes()
    assert len(hole) == 3
    whole = filled(mesh, [hole])
    assert (whole.n, whole.m) == (disk.n + 1, disk.m + 2)


def test_the_filled_surface_has_the_holes_closed_and_keeps_its_own_triangles():
    mesh = gallery.three_holes()
    outer, holes = mesh.outer_and_holes()
    disk = filled(mesh, holes)
    assert disk.n == mesh.n + 3
    assert (disk.F[: mesh.m] == mesh.F).all()
    assert set(disk.boundary) == set(outer)


def test_a_slit_is_filled_from_above():
    mesh = gallery.three_holes()
    _, holes = mesh.outer_and_holes()
    V = mesh.V.copy()
    V[holes[0]] = np.linspace(-0.1, 0.1, len(holes[0]))[:, None] * [1, 0, 0]
    disk = filled(HoledMesh.trusted(V, mesh.F), [holes[0]])
    a, b, c = (disk.V[disk.F[mesh.m :, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-4
