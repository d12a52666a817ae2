import numpy as np
import pytest
from cembench.algorithms.direct_cem.holes import direct_cem_holes
from cembench.surfaces.holed_disk import disk_with_holes
from cembench.surfaces.sheets import catenoid_ring

from cembench import HoledMesh, ParameterError
from cembench.conformal.metrics import all_metrics, boundary_circles
from cembench.linear_algebra.cholesky import Cholesky
from cembench.linear_algebra.cholmod import CholmodFactor
from cembench.mesh.files import read_mesh
from cembench.validation.alignment import distance
from tests import gallery
from tests.real_meshes import real_mesh

REAL = {  # mean angle error, degrees, that the map stays below
    "alex_3holes.obj": 0.75,
    "amoeba1.obj": 0.9,
    "amoeba2.obj": 4.0,
    "ict_face_narrow.obj": 1.55,
    "lion_5holes.obj": 1.395,
    "mask_2eyes.obj": 2.35,
    "mcqc_face2.obj": 0.867,
    "peaks_7holes.off": 3.05,
    "plane_26holes.ply": 4.5,
    "sophie_1hole.ply": 0.5,
}


def warped(centres, radii, faces):
    """A disk with round holes, and what exp made of it: a domain whose conformal image is known."""
    V, F = disk_with_holes(np.asarray(centres), np.asarray(radii), faces)
    z = V[:, 0] + 1j * V[:, 1]
    w = np.exp(0.8 * z)
    return z, HoledMesh.from_arrays(np.stack([w.real, w.imag, 0 * w.real], axis=1), F)


@pytest.mark.parametrize(
    ("centres", "radii"), [([0.3 + 0.1j], [0.3]), gallery.THREE_HOLES], ids=["one", "three"]
)
def test_on_plane_domains_with_known_circles_the_error_falls_at_second_order(centres, radii):
    errors = []
    for faces in (600, 9600):
        z, mesh = warped(centres, radii, faces)
        errors.append(distance(direct_cem_holes(mesh).uv, z, moebius=True))
    assert np.log2(errors[0] / errors[1]) / 2 > 1.6, errors


def modulus(mesh):
    inner, _ = sorted(circle.radius for circle in boundary_circles(mesh, direct_cem_holes(mesh).uv))
    return -np.log(inner)


def test_the_modulus_of_a_catenoid_converges_at_second_order():
    coarse, fine = (abs(modulus(catenoid_ring(faces, height=1.0)) - 1) for faces in (1500, 24_000))
    assert np.log2(coarse / fine) / 2 == pytest.approx(2, abs=0.15)


@pytest.mark.slow
def test_the_modulus_has_four_digits_at_fifty_thousand_vertices():
    assert abs(modulus(catenoid_ring(100_000, height=1.0)) - 1) < 5e-5


def test_one_factorisation_and_one_dirichlet_solve(count_calls):
    factored = count_calls(CholmodFactor, "_factor")
    dirichlet = count_calls(Cholesky, "extended")
    assert direct_cem_holes(gallery.three_holes()).iterations > 0
    assert (len(factored), len(dirichlet)) == (1, 1)


def test_energy_falls_from_step_to_step_and_is_that_of_the_map():
    _, mesh = warped(*gallery.THREE_HOLES, 1200)
    result = direct_cem_holes(mesh)
    assert (np.diff(result.energy_history) < 0).all()
    energy = all_metrics(mesh, result.uv)["conformal_energy"]
    assert result.energy_history[-1] == pytest.approx(energy, abs=1e-12)


def test_any_boundary_can_be_the_outer_one():
    _, mesh = warped(*gallery.THREE_HOLES, 1200)
    _, holes = mesh.outer_and_holes()
    uv = direct_cem_holes(mesh, outer=int(holes[0][0])).uv
    assert abs(abs(uv[holes[0]]) - 1).max() < 1e-12
    assert all_metrics(mesh, uv)["flipped_triangles"] == 0


def test_an_outer_vertex_off_the_boundary_is_refused():
    mesh = gallery.three_holes()
    with pytest.raises(ParameterError, match="boundary loop"):
        direct_cem_holes(mesh, outer=int(mesh.interior[0]))


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow if "plane" in n else []) for n in REAL],
)
def test_real_surfaces_with_holes(name):
    mesh = read_mesh(real_mesh(f"holes/{name}"), HoledMesh)
    result = direct_cem_holes(mesh)
    figures = all_metrics(mesh, result.uv)
    assert figures["flipped_triangles"] == 0
    assert figures["angle_error_mean_deg"] < REAL[name]
    assert figures["boundary_circularity"] < (1e-12 if "plane" not in name else 1e-10)
    assert result.energy_history[-1] < result.energy_history[0]
    assert result.extras["stopped"] == "gradient"
