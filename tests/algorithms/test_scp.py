import igl.spectra
import numpy as np
import pytest
from cembench.algorithms import scp as module
from cembench.algorithms.lscm import lscm
from cembench.algorithms.scp import scp
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed
from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from tests.real_meshes import DISKS, real_mesh


def uneven(faces=400):
    mesh = hemi_ellipsoid(faces, x=2.0)
    noise = np.random.default_rng(0).standard_normal(mesh.V.shape)
    return mesh.moved(mesh.V + 0.01 * noise)


def distance(z, other):
    """After the best similarity of the plane, relative."""
    fit = np.stack([z, np.ones(len(z))], axis=1)
    best = fit @ np.linalg.lstsq(fit, other, rcond=None)[0]
    return np.linalg.norm(best - other) / np.linalg.norm(other - other.mean())


def test_by_area_it_is_the_spectral_map_of_libigl():
    mesh = uneven()
    UV = igl.spectra.lscm(mesh.V, mesh.F)
    assert distance(scp(mesh, weights="area").uv, UV[:, 0] + 1j * UV[:, 1]) < 1e-6


@pytest.mark.parametrize("name", ["canonical_face.obj", "turtle.obj", "hand_lowres.obj"])
def test_by_area_it_is_that_of_libigl_on_real_surfaces(name):
    mesh = read_mesh(real_mesh(name))
    UV = igl.spectra.lscm(mesh.V, mesh.F)
    found = scp(mesh, weights="area", tolerance=1e-9)
    if found.extras["fold_repairs"] == 0:
        assert distance(found.uv, UV[:, 0] + 1j * UV[:, 1]) < 1e-6
    else:
        assert distance(found.uv, UV[:, 0] + 1j * UV[:, 1]) < 1e-2


@pytest.mark.parametrize("weights", ["boundary", "length"])
def test_on_the_boundary_alone_it_is_the_eigenvector_of_all_unknowns(weights):
    mesh = uneven()
    V, b = mesh.V, mesh.boundary
    Q = module.conformal_energy_form(module.laplacian(mesh), b).toarray()
    n = mesh.n
    W = np.zeros(n)
    lengths = np.linalg.norm(np.roll(V[b], -1, axis=0) - V[b], axis=1)
    W[b] = 1.0 if weights == "boundary" else lengths + np.roll(lengths, 1)
    # The largest values of W against the energy, those of the constants set apart.
    H = Q[:n, :n] + 1j * Q[n:, :n]
    lifted = H + np.outer(W, W)
    values, vectors = np.linalg.eig(np.linalg.solve(lifted, np.diag(W)))
    order = np.argsort(-values.real)
    near = [distance(scp(mesh, weights=weights).uv, vectors[:, k]) for k in order[:2]]
    assert min(near) < 1e-6


def test_its_energy_is_below_that_of_two_pins():
    for mesh in (uneven(), hemi_ellipsoid(3000, x=2.0)):
        least, pinned = (all_metrics(mesh, f(mesh).uv) for f in (scp, lscm))
        assert least["conformal_energy"] < pinned["conformal_energy"]
        # Angles are not what it minimises: on coarse surfaces they can be 1 % above.
        assert least["angle_error_mean_deg"] < 1.015 * pinned["angle_error_mean_deg"]


@pytest.mark.parametrize("name", DISKS)
@pytest.mark.slow
def test_its_energy_is_below_that_of_two_pins_on_real_surfaces(name):
    mesh = read_mesh(real_mesh(name))
    least, pinned = (all_metrics(mesh, f(mesh).uv) for f in (scp, lscm))
    assert least["conformal_energy"] < pinned["conformal_energy"]
    assert least["angle_error_mean_deg"] < pinned["angle_error_mean_deg"]


def test_a_long_boundary_is_solved_for_with_the_interior(monkeypatch):
    mesh = uneven()
    dense = scp(mesh).uv
    monkeypatch.setattr(module, "LARGEST_DENSE", 10)
    assert distance(scp(mesh).uv, dense) < 1e-6


@pytest.mark.parametrize("weights", ["boundary", "length", "area"])
def test_a_flat_surface_comes_out_as_it_is(weights):
    mesh = flat_disk(600, stretch=2.0)
    found = all_metrics(mesh, scp(mesh, weights=weights).uv)
    assert abs(found["conformal_energy"]) < 1e-9
    assert found["angle_error_mean_deg"] < 1e-3


def test_too_few_sweeps_are_a_failure():
    with pytest.raises(AlgorithmFailed, match="not converged after 1 sweeps"):
        scp(uneven(), max_iterations=1)
