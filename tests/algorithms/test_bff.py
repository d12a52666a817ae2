import numpy as np
import pytest
from cembench.algorithms.bff.disk import bff
from cembench.algorithms.bff.free import bff_free
from cembench.algorithms.bff.yamabe import YamabeBoundary
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.boundary_curve import closed_curve
from cembench.conformal.gauss_bonnet import vertex_curvatures
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from cembench.registry import load_registry
from tests import gallery
from tests.hard_surfaces import hard_surface
from tests.real_meshes import real_mesh


def test_curvatures_sum_to_two_pi_and_are_known_on_a_cap():
    for mesh in (hard_surface(0), hard_surface(3), flat_disk(300)):
        assert vertex_curvatures(mesh).sum() == pytest.approx(2 * np.pi, abs=1e-10)
    cap = spherical_cap(2000, angle=90.0)
    inside = vertex_curvatures(cap)[cap.interior].sum()
    assert inside == pytest.approx(2 * np.pi * (1 - np.cos(np.pi / 2)), rel=0.05)


@pytest.mark.parametrize("seed", range(5))
def test_exterior_angles_keep_gauss_bonnet_whatever_the_scale(seed):
    mesh = hard_surface(seed)
    yamabe = YamabeBoundary(mesh, delaunay=False)
    assert abs(yamabe.natural.sum() - 2 * np.pi) < 1e-10
    # The relation itself, against a dense solve of the whole system.
    b, i = mesh.boundary, mesh.interior
    L, k = laplacian(mesh).toarray(), vertex_curvatures(mesh)
    u = np.random.default_rng(seed).standard_normal(len(b))
    u_i = np.linalg.solve(L[np.ix_(i, i)], -k[i] - L[np.ix_(i, b)] @ (u - u.mean()))
    turns = k[b] + L[np.ix_(b, i)] @ u_i + L[np.ix_(b, b)] @ (u - u.mean())
    assert abs(turns.sum() - 2 * np.pi) < 1e-9
    assert abs(yamabe.scale(turns) - (u - u.mean())).max() < 1e-7


def test_a_disk_takes_about_ten_sweeps_and_gives_the_map_of_least_energy():
    for mesh in (hemi_ellipsoid(3000), spherical_cap(3000, angle=120.0), hard_surface(2)):
        result = bff(mesh)
        assert result.extras["sweeps"] <= 12
        assert result.extras["gauss_bonnet"] < 1e-10
    mesh = hemi_ellipsoid(3000)
    mine, least = (all_metrics(mesh, f(mesh).uv) for f in (bff, direct_cem))
    assert mine["conformal_energy"] == pytest.approx(least["conformal_energy"], rel=0.02)


def test_more_sweeps_do_not_move_the_map():
    mesh = spherical_cap(1000, angle=120.0)
    assert abs(bff(mesh).uv - bff(mesh, tolerance=1e-8).uv).max() < 1e-3


@pytest.mark.parametrize(
    "name", ["canonical_face.obj", "nefertiti.obj", "turtle.obj", "demosthenes.off"]
)
def test_real_surfaces_take_about_ten_sweeps(name):
    result = bff(read_mesh(real_mesh(name)))
    assert result.extras["sweeps"] <= 12


def test_a_boundary_beyond_numbers_is_a_failure():
    with pytest.raises(AlgorithmFailed, match="too crowded: in sweep 1"):
        bff(DiskMesh.from_arrays(*gallery.flat_rectangle(4, 160)), last_resort=False)


def test_a_developable_surface_is_unrolled_as_it_is():
    flat = flat_disk(600, stretch=2.0)
    t = flat.V[:, 0]
    rolled = flat.moved(np.column_stack([np.sin(t), flat.V[:, 1], np.cos(t)]))
    for mesh in (flat, rolled):
        result = bff_free(mesh)
        assert result.extras["closing"] < 0.02
    assert all_metrics(flat, bff_free(flat).uv)["angle_error_mean_deg"] < 1e-6


def test_the_free_boundary_keeps_its_lengths():
    mesh = hemi_ellipsoid(2000, x=1.5)
    result = bff_free(mesh)
    b = mesh.boundary
    stretch = np.abs(np.roll(result.uv[b], -1) - result.uv[b]) / np.linalg.norm(
        np.roll(mesh.V[b], -1, axis=0) - mesh.V[b], axis=1
    )
    assert np.ptp(stretch) < 1e-3 * stretch.mean()


@pytest.mark.parametrize("corners", [3, 4, 6])
def test_a_polygon_has_its_corners_and_angles_converge(corners):
    errors = []
    for faces in (500, 4000):
        mesh = hemi_ellipsoid(faces, x=1.5)
        z = bff_free(mesh, corners=corners).uv[mesh.boundary]
        turns = np.angle((np.roll(z, -1) - z) / (z - np.roll(z, 1)))
        assert np.count_nonzero(abs(turns) > 1e-6) == corners
        assert np.sort(turns)[-corners:] == pytest.approx(2 * np.pi / corners)
        uv = bff_free(mesh, corners=corners).uv
        errors.append(all_metrics(mesh, uv)["angle_error_mean_deg"])
    assert errors[1] < errors[0] / 1.4


def test_two_corners_are_refused():
    spec = load_registry().algorithm("bff-free")
    with pytest.raises(Exception, match="at least 3 corners"):
        spec.arguments({"corners": "2"})


def test_a_curve_that_cannot_close_is_a_failure():
    turns = np.array([np.pi, np.pi, 0.0, 0.0])
    with pytest.raises(AlgorithmFailed, match="does not close"):
        closed_curve(np.array([10.0, 1.0, 1.0, 1.0]), turns)
