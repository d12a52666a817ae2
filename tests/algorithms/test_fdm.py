import numpy as np
import pytest
from cembench.algorithms import fdm as module
from cembench.algorithms.fdm import _divisor_of_public_program, _middle, fdm
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import DiskMesh
from cembench.conformal.beltrami import beltrami_coefficients
from cembench.conformal.doubling import doubled
from cembench.conformal.harmonic import (
    HarmonicExtension,
    arc_length_circle,
    harmonic_extension,
)
from cembench.conformal.laplacian import laplacian, non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.conformal.planar import signed_areas
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.linear_algebra.work import counting
from cembench.mesh.files import read_mesh
from tests import gallery
from tests.real_meshes import real_mesh


def error_of_reflected_coefficients(faces):
    mesh = flat_disk(faces, stretch=1.4)
    z = mesh.V[:, 0] / 1.4 + 1j * mesh.V[:, 1]
    mu = beltrami_coefficients(z, mesh.F, mesh.V)
    double = doubled(mesh)
    both = double.on_both(module._reflected(z))
    both[: mesh.n] = z
    exact = beltrami_coefficients(both, double.F[mesh.m :], double.on_both(mesh.V))
    outer = np.abs(z)[mesh.F].min(axis=1) > 0.5  # elsewhere reflection is far from linear
    return np.abs(module._mirrored(mesh, z, mu) / exact - 1)[outer].max()


def test_reflected_coefficients_approach_those_of_the_reflected_map():
    coarse, fine = (error_of_reflected_coefficients(faces) for faces in (6 * 40**2, 6 * 80**2))
    assert fine < 0.15
    assert np.log2(coarse / fine) > 0.8, (coarse, fine)


def test_each_iteration_but_the_last_changes_the_distortion():
    mesh = hemi_ellipsoid(5000)
    result = fdm(mesh, max_iterations=20)
    assert 1 < result.iterations < 20
    assert len(result.energy_history) == result.iterations + 1
    assert fdm(mesh, max_iterations=2).iterations == 2
    assert result.energy_history[-1] < result.energy_history[0]


def test_the_history_ends_with_the_energy_of_the_map():
    mesh = hemi_ellipsoid(3000)
    result = fdm(mesh)
    measured = all_metrics(mesh, result.uv)["conformal_energy"]
    assert result.energy_history[-1] == pytest.approx(measured, rel=1e-9)


def test_ears_on_the_boundary_collapse_in_the_half_plane_and_do_no_harm():
    # The corner triangles of a rectangle have all three vertices on the boundary.
    V, F = gallery.flat_rectangle(12, 20)
    mesh = DiskMesh.from_arrays(V, F)
    assert any("without an interior neighbour" in notice.text for notice in mesh.notices)
    assert all_metrics(mesh, fdm(mesh).uv)["flipped_triangles"] == 0


def test_a_start_that_folds_gives_way_to_uniform_weights():
    mesh = gallery.crumpled_disk()
    L = laplacian(mesh)
    folded = harmonic_extension(L, mesh.boundary, arc_length_circle(mesh))
    assert (signed_areas(folded, mesh.F) < 0).any()
    inside = HarmonicExtension(L, mesh.boundary)
    assert (signed_areas(module._start(mesh, inside), mesh.F) > 0).all()


def test_iterations_that_diverge_on_a_coarse_mesh_are_dropped():
    mesh = hemi_ellipsoid(200, z=12.0)
    result = fdm(mesh)
    assert result.extras["iterations_dropped"] > 0
    assert result.iterations + result.extras["iterations_dropped"] == 5
    energy = all_metrics(mesh, result.uv)["conformal_energy"]
    assert result.energy_history[-1] == pytest.approx(energy)
    # The least mean |mu| is kept, whose energy is near the least one.
    assert result.energy_history[-1] < 1.05 * min(result.energy_history)


def test_the_public_program_gives_the_printed_digits_of_nefertiti():
    mesh = read_mesh(real_mesh("nefertiti.obj"))
    items = [all_metrics(mesh, fdm(mesh.fresh(), public_program=slip).uv) for slip in (True, False)]
    keys = ("conformal_energy", "angle_error_mean_deg", "angle_error_sd_deg")
    slip, corrected = ([one[key] for key in keys] for one in items)
    assert [f"{slip[0]:.4f}", f"{slip[1]:.2f}", f"{slip[2]:.2f}"] == ["0.0242", "2.48", "3.36"]
    assert slip == pytest.approx([0.02416, 2.4768, 3.3558], abs=1e-4)
    assert f"{corrected[0]:.4f}" == "0.0241"


def test_the_public_program_returns_the_last_iterate_and_turns_by_a_and_half_of_b():
    mesh = hemi_ellipsoid(150, z=12.0)  # on others rounding decides
    assert fdm(mesh, public_program=True).extras["iterations_dropped"] == 0
    assert fdm(mesh).extras["iterations_dropped"] > 0
    p, q = np.exp(0.4j), np.exp(0.6j)
    assert np.angle(_middle(p, q)) == pytest.approx(0.5)
    assert np.angle(_divisor_of_public_program(p, q)) == pytest.approx(0.7)


def test_delaunay_weights_are_nearer_to_the_surface_where_its_edges_are_not_delaunay():
    smooth = flat_disk(600)
    V = smooth.V[:, :2] + 0.03 * np.random.default_rng(0).standard_normal((smooth.n, 2))
    mesh = DiskMesh.from_arrays(np.column_stack([V, 0 * V[:, 0]]), smooth.F)
    assert non_delaunay_share(mesh) > 0.05
    errors = [
        all_metrics(mesh, fdm(mesh, delaunay=delaunay).uv)["angle_error_mean_deg"]
        for delaunay in (True, False)
    ]
    assert errors[0] < 1.05 * errors[1]
    assert errors[0] != errors[1]


def test_the_five_last_solves_share_the_factor_of_the_start_where_factors_are_reused():
    mesh = hemi_ellipsoid(3000)
    found, work = {}, {}
    for solves in ("reuse", "backslash"):
        with linear_algebra(solves), counting() as work[solves]:
            found[solves] = fdm(mesh, tolerance=0)
    assert found["reuse"].iterations == 5
    # The start, two in the half plane, and two in each iteration; the paper's program has 13.
    assert [work[solves].numeric for solves in ("reuse", "backslash")] == [8, 13]
    assert work["reuse"].right_hand_sides == work["backslash"].right_hand_sides
    assert abs(found["reuse"].uv - found["backslash"].uv).max() < 1e-11
