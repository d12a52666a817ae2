import numpy as np
import pytest
from cembench.algorithms.angenent_haker import angenent_haker
from cembench.algorithms.cem import cem
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.boundary_iteration import pole
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from tests.real_meshes import real_mesh


def test_on_the_circle_it_is_the_start_of_cem():
    mesh = hemi_ellipsoid(1500, x=1.5)
    b = mesh.boundary
    on_circle = angenent_haker(mesh).uv[b]
    start = cem(mesh, max_iterations=0).uv[b]
    assert abs(on_circle / abs(on_circle) - start).max() < 1e-9


def test_the_boundary_is_that_of_the_linear_map_whatever_vertex_is_pinned():
    """Theorem 1: any index may be pinned; Eqs. 13 and 14 by a dense solve."""
    mesh = hemi_ellipsoid(300, x=1.5)
    b, L = mesh.boundary, laplacian(mesh).toarray()
    corners, values = pole(mesh.V, mesh.F)
    rhs = np.zeros(mesh.n, dtype=complex)
    rhs[corners] = values
    found = angenent_haker(mesh).uv[b]
    for k in (0, 7, mesh.n - 1):
        u = np.delete(np.arange(mesh.n), k)
        f = np.zeros(mesh.n, dtype=complex)
        f[u] = np.linalg.solve(L[np.ix_(u, u)], rhs[u])
        f = np.conj(f[b] - f[b].mean())
        assert abs(f / f[0] - found / found[0]).max() < 1e-9


def test_a_triangle_without_height_in_the_middle_is_passed_over_for_the_next():
    V = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 0], [1.5, 1.5, 0]])
    F = np.array([[4, 5, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    corners, values = pole(V, F)
    assert set(corners) == {1, 2, 4}
    assert np.isfinite(values).all()
    np.testing.assert_array_equal(pole(V[:, :2], F)[0], corners)


def test_the_natural_boundary_of_a_flat_disk_is_a_circle_and_its_map_converges():
    coarse, fine = (
        all_metrics(mesh, angenent_haker(mesh).uv) for mesh in map(flat_disk, (500, 2000))
    )
    for name in ("boundary_circularity", "angle_error_mean_deg"):
        assert 1.8 < coarse[name] / fine[name] < 2.5  # half the edges: first order
    assert fine["boundary_circularity"] < 0.02
    assert fine["angle_error_mean_deg"] < 1.6


@pytest.mark.parametrize("name", ["chinese_lion.obj", "human_face.obj"])
def test_cem_improves_on_it(name):
    mesh = read_mesh(real_mesh(name))
    start, end = (all_metrics(mesh, f(mesh).uv) for f in (angenent_haker, cem))
    assert end["angle_error_mean_deg"] < start["angle_error_mean_deg"]
