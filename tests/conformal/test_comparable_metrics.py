"""The figures that maps of different methods are compared by, against independent computations."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import shapely
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import DiskMesh
from cembench.conformal.metrics import all_metrics
from cembench.conformal.moebius import Moebius
from cembench.conformal.planar import overlap_share, windings
from tests import gallery


def planar(mesh):
    return mesh.V[:, 0] + 1j * mesh.V[:, 1]


def uneven_square(columns=8):
    """The unit square in columns of unequal width: triangles of unequal area."""
    i, j, F = gallery.grid(4, columns)
    return DiskMesh.from_arrays(np.stack([(j / columns) ** 2, i / 4, 0 * i], 1), F)


def moved(uv, a):
    """A Moebius map of the disk that carries a to 0."""
    return Moebius(1, -a, -np.conj(a), 1)(uv)


def test_one_affine_map_has_one_beltrami_coefficient_and_no_area_distortion():
    mesh, s = uneven_square(), 3.0
    metrics = all_metrics(mesh, 5 * (s * mesh.V[:, 0] + 1j * mesh.V[:, 1]))
    assert metrics["beltrami_area_mean"] == pytest.approx((s - 1) / (s + 1))
    assert metrics["beltrami_max"] == pytest.approx((s - 1) / (s + 1))
    assert metrics["area_distortion_mean"] < 1e-12
    assert metrics["area_distortion_sd"] < 1e-12
    assert metrics["overlap_share"] == 0
    assert "common_gauge_energy" not in metrics  # not a disk


def test_two_affine_maps_count_by_the_surface_area_not_by_triangles():
    """The left quarter of the area stays, the rest is stretched by e: log ratios of 0 and 1."""
    mesh = uneven_square()
    x, y = mesh.V[:, 0], mesh.V[:, 1]
    metrics = all_metrics(mesh, np.where(x > 0.25, 0.25 + np.e * (x - 0.25), x) + 1j * y)
    mu = (np.e - 1) / (np.e + 1)
    assert metrics["beltrami_area_mean"] == pytest.approx(0.75 * mu)
    assert metrics["beltrami_max"] == pytest.approx(mu)
    assert metrics["area_distortion_mean"] == pytest.approx(2 * 0.25 * 0.75)
    assert metrics["area_distortion_sd"] == pytest.approx(np.sqrt(0.25 * 0.75))


def slow_figures(mesh, uv):
    """|mu| in the mean by area and at most, mean and SD of log area ratios: fifty digits.

    With singular values s and t, s^2 + t^2 comes from the cotangent formula of Dirichlet's energy
    and s t from the areas; |mu|^2 = (s^2 + t^2 - 2 s t) / (s^2 + t^2 + 2 s t).
    """
    with localcontext() as context:
        context.prec = 50
        areas, moduli, logs = [], [], []
        for face in mesh.F.tolist():
            P = [[Decimal(x) for x in mesh.V[k].tolist()] for k in face]
            q = [(Decimal(uv[k].real), Decimal(uv[k].imag)) for k in face]

            def dot(a, b, o):
                return sum((x - z) * (y - z) for x, y, z in zip(a, b, o, strict=True))

            dots = [dot(P[k - 2], P[k - 1], P[k]) for k in range(3)]
            double = (dots[0] * dots[1] + dots[1] * dots[2] + dots[2] * dots[0]).sqrt()
            sides = [dot(q[k - 2], q[k - 2], q[k - 1]) for k in range(3)]
            squares = sum(d / double * s for d, s in zip(dots, sides, strict=True)) / double
            image = (q[1][0] - q[0][0]) * (q[2][1] - q[0][1])
            image -= (q[1][1] - q[0][1]) * (q[2][0] - q[0][0])
            twice = 2 * abs(image) / double
            areas.append(double / 2)
            moduli.append(max((squares - twice) / (squares + twice), Decimal(0)).sqrt())
            logs.append((abs(image) / double).ln())
        total = sum(areas)
        middle = sum(a * x for a, x in zip(areas, logs, strict=True)) / total
        mean = sum(a * m for a, m in zip(areas, moduli, strict=True)) / total
        off = sum(a * abs(x - middle) for a, x in zip(areas, logs, strict=True)) / total
        sd = (sum(a * (x - middle) ** 2 for a, x in zip(areas, logs, strict=True)) / total).sqrt()
        return [float(x) for x in (mean, max(moduli), off, sd)]


@pytest.mark.parametrize("folds", [False, True])
def test_against_fifty_digits(folds):
    mesh = hemi_ellipsoid(150)
    rng = np.random.default_rng(1)
    uv = 3 * planar(mesh) + (0.5 if folds else 0.02) * rng.standard_normal((mesh.n, 2)) @ [1, 1j]
    metrics = all_metrics(mesh, uv)
    assert bool(metrics["flipped_triangles"]) == folds
    names = ("beltrami_area_mean", "beltrami_max", "area_distortion_mean", "area_distortion_sd")
    np.testing.assert_allclose([metrics[name] for name in names], slow_figures(mesh, uv), rtol=1e-9)


@pytest.mark.parametrize("a", [0.1, -0.6 + 0.3j, 0.9j])
def test_a_moebius_map_of_the_disk_changes_neither_energy_nor_area_in_the_common_gauge(a):
    mesh = hemi_ellipsoid(400)
    z = planar(mesh)
    uv = z / np.abs(z[mesh.boundary]).max() * (1 + 0.1 * (1 - np.abs(z) ** 2))
    uv[mesh.boundary] /= np.abs(uv[mesh.boundary])
    before, after = all_metrics(mesh, uv), all_metrics(mesh, moved(uv, a))
    assert abs(after["conformal_energy"] / before["conformal_energy"] - 1) > 1e-3
    for name in ("common_gauge_energy", "area_distortion_mean", "area_distortion_sd"):
        assert after[name] == pytest.approx(before[name], rel=1e-9), name


def test_a_moebius_map_changes_the_beltrami_coefficients_by_the_discretisation_alone():
    changes = []
    for faces in (400, 1600, 6400):
        mesh = flat_disk(faces)
        uv = planar(mesh) + 0.2 * np.conj(planar(mesh))
        before = all_metrics(mesh, uv)["beltrami_area_mean"]
        assert before == pytest.approx(0.2)
        moebius = moved(uv / 1.3, 0.4)
        changes.append(abs(all_metrics(mesh, moebius)["beltrami_area_mean"] - before))
    assert changes[1] < 0.6 * changes[0]
    assert changes[2] < 0.6 * changes[1]


def test_the_mean_by_area_of_a_centred_disk_is_its_middle():
    mesh = flat_disk(600)
    metrics = all_metrics(mesh, moved(planar(mesh), 0.5))
    assert metrics["conformal_energy"] > 1e-5
    assert abs(metrics["common_gauge_energy"]) < 1e-12  # the identity comes back, but for a turn


def test_a_disk_that_has_no_common_gauge_says_so():
    mesh = flat_disk(600)
    uv = planar(mesh)
    uv[0] = 5
    metrics = all_metrics(mesh, uv)
    assert metrics["common_gauge_energy"] == np.inf
    assert metrics["area_distortion_sd"] == np.inf


def test_a_collapsed_triangle_has_mu_1_and_no_area_to_take_the_logarithm_of():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle())
    uv = planar(mesh)
    uv[8] = uv[7]
    metrics = all_metrics(mesh, uv)
    assert metrics["beltrami_max"] == 1
    assert metrics["area_distortion_mean"] == np.inf


def spiral(turns, n=200):
    """A strip that goes round a ring `turns` times: fold-free, and over itself beyond one turn."""
    i, j, F = gallery.grid(3, n)
    mesh = DiskMesh.from_arrays(np.stack([j, i, 0 * i], 1).astype(float), F)
    return mesh, (2 - i / 3) * np.exp(2j * np.pi * turns * j / n)


@pytest.mark.parametrize("turns", [0.5, 1.25, 1.5, 2.6])
def test_the_share_of_a_ring_that_is_covered_again(turns):
    mesh, uv = spiral(turns)
    metrics = all_metrics(mesh, uv)
    assert metrics["flipped_triangles"] == 0
    assert metrics["overlap_share"] == pytest.approx(max(turns - 1, 0) / turns, abs=2e-3)
    corners = np.stack([uv.real, uv.imag], axis=1)[mesh.F]
    union = shapely.union_all(shapely.polygons(corners)).area
    share = 1 - union / metrics["image_area"]
    assert metrics["overlap_share"] == pytest.approx(share, abs=1e-9)
    mirrored = all_metrics(mesh, uv.conj())["overlap_share"]
    assert mirrored == pytest.approx(metrics["overlap_share"], abs=1e-12)


def test_a_hole_is_not_covered_and_a_scrambled_boundary_is_not_measured():
    square = 4 * np.array([0, 1, 1 + 1j, 1j])
    hole = (square / 4 + 1 + 1j)[::-1]
    assert overlap_share([square, hole]) == 0
    # Shifted half out: a strip of 1/2 by 1 is taken away where nothing is, and added nowhere.
    assert overlap_share([square, hole - 1.5]) == 0
    scrambled = np.random.default_rng(0).standard_normal((2, 600)).T @ [1, 1j]
    assert overlap_share([scrambled]) == np.inf
    assert windings(np.array([0.5 + 0.5j, 9]), square, np.roll(square, -1)).tolist() == [1, 0]
