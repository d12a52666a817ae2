import igl.spectra
import numpy as np
import pytest
from cembench.algorithms import scp as module
from cembench.algorithms.lscm import lscm
from cembench.algorithms.scp import scp
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.metrics import all_metrics
from cembench.mesh.files import read_mesh
from cembench.registry import load_registry
from cembench.validation.alignment import distance
from tests import gallery
from tests.real_meshes import DISKS, real_mesh


def test_by_area_it_is_the_spectral_map_of_libigl():
    mesh = gallery.uneven(400)
    UV = igl.spectra.lscm(mesh.V, mesh.F)
    assert distance(scp(mesh, weights="area").uv, UV[:, 0] + 1j * UV[:, 1], moebius=False) < 1e-6


@pytest.mark.parametrize("name", ["canonical_face.obj", "turtle.obj", "hand_lowres.obj"])
def test_by_area_it_is_that_of_libigl_on_real_surfaces(name):
    mesh = read_mesh(real_mesh(name))
    UV = igl.spectra.lscm(mesh.V, mesh.F)
    result = scp(mesh, weights="area", tolerance=1e-9)
    if result.extras["fold_repairs"] == 0:
        assert distance(result.uv, UV[:, 0] + 1j * UV[:, 1], moebius=False) < 1e-6
    else:
        assert distance(result.uv, UV[:, 0] + 1j * UV[:, 1], moebius=False) < 1e-2


@pytest.mark.parametrize("weights", ["boundary", "length"])
def test_on_the_boundary_alone_it_is_the_eigenvector_of_all_unknowns(weights):
    mesh = gallery.uneven(400)
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
    near = [
        distance(scp(mesh, weights=weights).uv, vectors[:, k], moebius=False) for k in order[:2]
    ]
    assert min(near) < 1e-6


def test_its_energy_is_below_that_of_two_pins():
    for mesh in (gallery.uneven(400), hemi_ellipsoid(3000, x=2.0)):
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
    # On Nefertiti 0.7 % above, as the map of libigl has it too; below on all others.
    assert least["angle_error_mean_deg"] < 1.015 * pinned["angle_error_mean_deg"]


def quotient(mesh, z):
    """What it minimises, computed from the triangles alone: E_C over the boundary's spread."""
    F = mesh.F
    energy = 0.0
    for t in F:
        a, b, c = mesh.V[t]
        x = np.linalg.norm(b - a)
        y = np.dot(c - a, b - a) / x
        plane = np.array([[0, 0], [x, 0], [y, np.sqrt(np.dot(c - a, c - a) - y**2)]])
        J = np.stack([z[t[1:]].real - z[t[0]].real, z[t[1:]].imag - z[t[0]].imag])
        J = J @ np.linalg.inv(plane[1:].T)
        s = np.linalg.svd(J, compute_uv=False) * [1, np.sign(np.linalg.det(J))]
        energy += 0.25 * x * plane[2, 1] * (s[0] - s[1]) ** 2
    on = z[mesh.boundary]
    return energy / np.sum(np.abs(on - on.mean()) ** 2)


@pytest.mark.parametrize("name", ["uneven", "nefertiti.obj"])
def test_no_free_boundary_has_less_energy_for_its_constraint(name):
    mesh = gallery.uneven(150) if name == "uneven" else read_mesh(real_mesh(name))
    known = load_registry().algorithms.values()
    free = [a for a in known if a.target == "free boundary" and a.library is None]
    assert len(free) >= 7
    of = {a.name: quotient(mesh, a.function(mesh.fresh(), **a.arguments({})).uv) for a in free}
    assert min(of, key=of.get) == "scp"
    assert of["lscm"] > 1.01 * of["scp"]


def test_where_its_angles_are_above_those_of_two_pins_so_are_libigl_s():
    """Nefertiti: energy 4 % below and angles above, in a program that shares no code with ours."""
    mesh = read_mesh(real_mesh("nefertiti.obj"))
    UV = igl.spectra.lscm(mesh.V, mesh.F)
    theirs = UV[:, 0] + 1j * UV[:, 1]
    theirs, pinned = all_metrics(mesh, theirs), all_metrics(mesh, lscm(mesh).uv)
    energies = [m["conformal_energy"] / abs(m["image_area"]) for m in (theirs, pinned)]
    assert energies[0] < 0.98 * energies[1]
    assert theirs["angle_error_mean_deg"] > pinned["angle_error_mean_deg"]


def test_a_long_boundary_is_solved_for_with_the_interior(monkeypatch):
    mesh = gallery.uneven(400)
    dense = scp(mesh).uv
    monkeypatch.setattr(module, "LARGEST_DENSE", 10)
    assert distance(scp(mesh).uv, dense, moebius=False) < 1e-6


@pytest.mark.parametrize("weights", ["boundary", "length", "area"])
def test_a_flat_surface_comes_out_as_it_is(weights):
    mesh = flat_disk(600, stretch=2.0)
    metrics = all_metrics(mesh, scp(mesh, weights=weights).uv)
    assert abs(metrics["conformal_energy"]) < 1e-9
    assert metrics["angle_error_mean_deg"] < 1e-3
