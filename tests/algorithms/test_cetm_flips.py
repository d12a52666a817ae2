import re

import numpy as np
import pytest
from cembench.algorithms.cetm.disk import cetm
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.cetm.triangle_map import K, disk_of_triangle
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy.special import beta, hyp2f1

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.doubling import doubled
from cembench.conformal.laplacian import laplacian_of_weights
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from cembench.mesh.intrinsic import Triangulation
from tests.campaign.hard_meshes import hard_mesh
from tests.hard_surfaces import hard_surface
from tests.real_meshes import DISKS, real_mesh


def doubled_triangulation(mesh):
    double = doubled(mesh)
    return Triangulation.doubled(mesh.F, mesh.V, double.mirror), double.size


def assert_glued(T):
    h = np.arange(len(T.twin))
    assert (T.twin[T.twin] == h).all()
    assert (T.twin != h).all()
    start, end = T.F.ravel(), np.roll(T.F, -1, axis=1).ravel()
    assert (start[T.twin] == end).all()
    assert T.log_length[T.twin] == pytest.approx(T.log_length, abs=1e-9)


def test_the_triangle_map_is_the_inverse_of_its_integral():
    w = np.array([0.3 + 0.2j, 0.9 * np.exp(2j), 0.99, -0.5j, -0.95, 0])
    z = w * hyp2f1(1 / 3, 2 / 3, 4 / 3, w**3)
    assert abs(disk_of_triangle(z) - w).max() < 1e-12
    assert pytest.approx(beta(1 / 3, 1 / 3) / 3) == K
    # Periods, and the three sides on the unit circle.
    assert abs(disk_of_triangle(z + 3 * K * np.exp(2j * np.pi / 3)) - w).max() < 1e-11
    corners = K * np.exp(2j * np.pi * np.arange(3) / 3)
    t = np.linspace(0.1, 0.9, 9)[:, None]
    assert abs(abs(disk_of_triangle(t * corners + (1 - t) * np.roll(corners, 1))) - 1).max() < 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_flips_give_the_intrinsic_delaunay_triangulation(seed):
    """None of its weights is negative, and the area is kept."""
    mesh = hard_surface(seed)
    T, n = doubled_triangulation(mesh)
    area = T_area(T)
    T.make_delaunay(np.zeros(n), flat=True)
    assert T.flips > 0
    assert_glued(T)
    assert T_area(T) == pytest.approx(area, rel=1e-9)
    lengths = np.exp(np.roll(T.log_length.reshape(-1, 3), -1, axis=1))
    L = laplacian_of_weights(T.F, half_cotangents(lengths), n).toarray()
    np.fill_diagonal(L, 0.0)
    assert L.max() < 1e-8


def T_area(T):
    a, b, c = np.exp(T.log_length.reshape(-1, 3)).T
    s = (a + b + c) / 2
    return np.sqrt(np.maximum(s * (s - a) * (s - b) * (s - c), 0)).sum()


def half_cotangents(lengths):
    squared = lengths**2
    a, b, c = lengths.T
    s = (a + b + c) / 2
    area = np.sqrt(s * (s - a) * (s - b) * (s - c))
    return (squared.sum(axis=1, keepdims=True) - 2 * squared) / (8 * area[:, None])


def test_ptolemy_s_flips_keep_scaling_out():
    """Flips at other scales, and back: the lengths are those of the first triangulation."""
    mesh = hemi_ellipsoid(300)
    T, n = doubled_triangulation(mesh)
    zero = np.zeros(n)
    T.make_delaunay(zero)
    before, flips = np.sort(T.log_length), T.flips
    T.make_delaunay(0.8 * np.random.default_rng(0).standard_normal(n))
    assert T.flips > flips + 20
    assert_glued(T)
    T.make_delaunay(zero)
    assert np.sort(T.log_length) == pytest.approx(before, abs=1e-9)


def test_it_approaches_the_map_of_cetm():
    errors = []
    for faces in (400, 1600):
        mesh = hemi_ellipsoid(faces, x=1.3)
        one, other = (f(mesh).uv for f in (cetm, cetm_flips))
        turn = np.vdot(other, one)
        errors.append(abs(other * turn / abs(turn) - one).max())
    assert errors[1] < errors[0] / 1.8


@pytest.mark.parametrize("seed", range(10))
def test_it_ends_where_cetm_cannot(seed):
    mesh = hard_surface(seed)
    result = cetm_flips(mesh)
    assert result.extras["curvature"] < 1e-9
    assert result.extras["folded_before_repair"] <= 0.05 * mesh.m


@pytest.mark.parametrize("name", ["nefertiti.obj", "hand_lowres.obj", "canonical_face.obj"])
def test_it_ends_on_real_surfaces(name):
    result = cetm_flips(read_mesh(real_mesh(name)))
    assert result.extras["curvature"] < 1e-9
    assert result.extras["layout"] < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("name", [*DISKS, "stress/maze.obj", "stress/hippocampus_unfoldiso.obj"])
def test_it_ends_on_every_disk(name):
    result = cetm_flips(read_mesh(real_mesh(name)))
    assert result.extras["curvature"] < 1e-9
    assert result.extras["folded_before_repair"] >= 0


def test_a_flat_disk_comes_out_nearly_as_it_is():
    mesh = flat_disk(1500)
    metrics = all_metrics(mesh, cetm_flips(mesh).uv)
    assert metrics["angle_error_mean_deg"] < 1.0


@pytest.mark.parametrize("number", [1, 2])
def test_needles_whose_flips_go_round_in_circles_are_refused_in_a_moment(number):
    """64 and 96 triangles: their angles have lost the digits that tell which diagonal is right."""
    _, V, F = hard_mesh(20261122, number)
    mesh = DiskMesh.from_arrays(V, F)
    with pytest.raises(AlgorithmFailed, match=r"still being flipped after (\d+) rounds") as raised:
        cetm_flips(mesh, last_resort=False)
    assert int(re.findall(r"\d+", str(raised.value))[0]) < 1000 + 50 * mesh.m


def test_scale_factors_beyond_all_numbers_are_no_warning():
    T, n = doubled_triangulation(hemi_ellipsoid(200))
    T.make_delaunay(np.where(np.arange(n) % 2, 1500.0, -1500.0))
    assert_glued(T)
