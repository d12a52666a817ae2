"""Surfaces with holes: known images, real faces, and what the choices of the method do."""

import numpy as np
import pytest
from cembench.algorithms.harmonic_filled import harmonic_filled
from cembench.algorithms.koebe_cem import steps as koebe
from cembench.algorithms.koebe_cem.koebe_cem import koebe_cem
from cembench.algorithms.koebe_cem.steps import koebe_steps
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.holed_disk import disk_with_holes

from cembench import HoledMesh, MeshError
from cembench.conformal.metrics import all_metrics, boundary_circles
from cembench.core.errors import ParameterError
from cembench.linear_algebra.cholmod import CholmodFactor
from cembench.mesh.files import read_mesh
from cembench.running.map_promises import faults
from cembench.validation.alignment import distance
from tests import gallery
from tests.real_meshes import real_mesh

#: Iterated until nothing changes, so that what is left is the mesh's own error.
CONVERGED = {"sweeps": 3, "max_iterations": 300, "tolerance": 1e-12}
DOMAINS = {
    "concentric annulus": ((0j,), (0.4,)),
    "eccentric annulus": ((0.35 + 0j,), (0.3,)),
    "three holes": gallery.THREE_HOLES,
}
REAL = (
    "alex_3holes.obj",
    "sophie_1hole.ply",
    "peaks_7holes.off",
    "amoeba1.obj",
    "mask_2eyes.obj",
    "ict_face_narrow.obj",
    "plane_26holes.ply",
)


def warped(centres, radii, faces):
    """A disk with round holes carried by z + z^2 / 5, which is conformal; and z."""
    V, F = disk_with_holes(centres, radii, faces)
    z = V[:, 0] + 1j * V[:, 1]
    w = z + z**2 / 5
    return HoledMesh.from_arrays(np.stack([w.real, w.imag, 0 * w.real], 1), F), z


def modulus(circle):
    """Of the ring between the unit circle and this one: log(outer / inner) / 2 pi, concentric."""
    c, r = circle
    return np.arccosh((1 + r * r - abs(c) ** 2) / (2 * r)) / (2 * np.pi)


@pytest.mark.parametrize("name", DOMAINS)
def test_known_domains_come_out_up_to_a_moebius_map_with_an_error_that_falls(name):
    centres, radii = DOMAINS[name]
    errors, sizes = [], (500, 2000, 8000)
    for faces in sizes:
        mesh, z = warped(centres, radii, faces)
        result = koebe_cem(mesh, **CONVERGED)
        assert not faults(koebe_cem.__cembench__, mesh, result.uv)
        errors.append(distance(z, result.uv, moebius=True))
    rate = -np.polyfit(np.log(np.sqrt(sizes)), np.log(errors), 1)[0]
    print(name, errors, rate)
    assert rate > 1.3
    assert errors[-1] < 3e-4


@pytest.mark.parametrize("name", ["concentric annulus", "eccentric annulus"])
def test_the_modulus_of_an_annulus(name):
    (c,), (r,) = DOMAINS[name]
    off = []
    for faces in (2000, 8000):
        mesh, _ = warped((c,), (r,), faces)
        uv = koebe_cem(mesh, **CONVERGED).uv
        hole = boundary_circles(mesh, uv)[1]
        off.append(abs(modulus((hole.centre, hole.radius)) / modulus((c, r)) - 1))
    print(name, off)
    assert off[1] < 1e-4
    assert off[1] < off[0] / 2


def test_holes_are_exact_circles_unless_rounding_is_off():
    mesh, _ = warped(*gallery.THREE_HOLES, 2000)
    assert all_metrics(mesh, koebe_cem(mesh).uv)["boundary_circularity"] < 1e-10
    rough = koebe_cem(mesh, rounding=False)
    found = all_metrics(mesh, rough.uv)["boundary_circularity"]
    assert 1e-4 < found < 0.05
    assert found == rough.extras["circularity_before_rounding"]


def test_keeping_the_surfaces_weights_is_what_stops_errors_from_piling_up():
    mesh = read_mesh(real_mesh("holes/alex_3holes.obj"), HoledMesh)
    plain = {"weights": "plane", "patches": "fans", "rounding": False}
    angles = {}
    for name, options in (("plain", plain), ("kept", {})):
        uv = koebe_cem(mesh, **options).uv
        angles[name] = all_metrics(mesh, uv)["angle_error_mean_deg"]
    print(angles)
    assert angles["plain"] > 4 * angles["kept"]


def test_one_factorisation_serves_all_steps(count_calls):
    mesh, _ = warped(*gallery.THREE_HOLES, 1000)
    calls = count_calls(CholmodFactor, "_factor")
    list(koebe_steps(mesh, sweeps=3))
    assert len(calls) == 1


def test_every_boundary_is_a_circle_right_after_its_step_and_the_outer_one_comes_last():
    mesh, _ = warped(*gallery.THREE_HOLES, 1000)
    steps = list(koebe_steps(mesh, sweeps=2))
    assert [(s.sweep, s.boundary) for s in steps] == [(w, k) for w in (1, 2) for k in (3, 2, 1, 0)]
    outer, holes = mesh.outer_and_holes()
    loops = (outer, *holes)
    for step in steps:
        assert abs(abs(step.uv[loops[step.boundary]]) - 1).max() < 1e-12
        others = [loop for k, loop in enumerate(loops) if k != step.boundary]
        assert max(abs(step.uv[loop]).max() for loop in others) < 1


def test_a_named_outer_boundary_comes_to_lie_outside():
    mesh, _ = warped(*gallery.THREE_HOLES, 1000)
    _, holes = mesh.outer_and_holes()
    for solver in (koebe_cem, harmonic_filled):
        uv = solver(mesh, outer=int(holes[1][0])).uv
        assert abs(abs(uv[holes[1]]) - 1).max() < 1e-12
        assert not faults(solver.__cembench__, mesh, uv)


def test_an_outer_boundary_that_is_none_is_named():
    mesh = gallery.three_holes()
    for solver in (koebe_cem, harmonic_filled):
        with pytest.raises(ParameterError, match=r"outer=100000: .* is not a vertex"):
            solver(mesh, outer=100_000)


def test_a_hole_of_three_vertices_is_mapped():
    disk = flat_disk(600)
    F = np.delete(disk.F, np.flatnonzero((disk.F == 0).any(axis=1))[0], axis=0)
    mesh = HoledMesh.from_arrays(disk.V, F)
    for solver in (koebe_cem, harmonic_filled):
        assert not faults(solver.__cembench__, mesh, solver(mesh).uv)


def touching_holes():
    """Two triangles that share a corner are cut out of a disk."""
    disk = flat_disk(600)
    around = np.flatnonzero((disk.F == 0).any(axis=1))
    return disk.V, np.delete(disk.F, [around[0], _opposite(disk.F, around)], axis=0)


def _opposite(F, around):
    """The triangle at vertex 0 that shares only that vertex with the first."""
    for k in around[1:]:
        if len(set(F[k]) & set(F[around[0]])) == 1:
            return k
    raise AssertionError


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        (gallery.tetrahedron, "the surface is closed"),
        (gallery.two_pieces, "2 connected components"),
        (touching_holes, "non-manifold vertex 0"),
        (gallery.flat_rectangle, "single boundary loop"),
        (lambda: _twice_punctured(*gallery.torus()), "genus 1"),
    ],
)
def test_surfaces_that_are_no_disk_with_holes(surface, message):
    with pytest.raises(MeshError, match=message):
        HoledMesh.from_arrays(*surface())


def _twice_punctured(V, F):
    apart = next(k for k in range(1, len(F)) if not set(F[k]) & set(F[0]))
    return V, np.delete(F, [0, apart], axis=0)


def test_a_crowded_rim_falls_back_to_its_own_polygon():
    star = np.exp(-2j * np.pi * np.arange(40) / 40) * np.tile([1, 0.1], 20)
    star *= np.exp(1.5j * np.sin(3 * np.arange(40)))
    rim = np.stack([star.real, star.imag], axis=1)
    np.testing.assert_allclose(koebe._patch(rim, "disks"), koebe.fan_patch(rim))


def test_rims_whose_disks_have_no_positive_energy_are_filled_by_their_own_polygons(monkeypatch):
    mesh = gallery.three_holes(600)
    own = koebe_cem(mesh, patches="fans").uv
    assert np.abs(koebe_cem(mesh).uv - own).max() > 1e-6
    monkeypatch.setattr(koebe, "disk_patch", lambda angles: -1e9 * np.eye(len(angles)))
    np.testing.assert_allclose(koebe_cem(mesh).uv, own, atol=1e-12)


@pytest.mark.parametrize("name", REAL)
def test_real_surfaces_map_without_folds_and_with_round_holes(name):
    mesh = read_mesh(real_mesh(f"holes/{name}"), HoledMesh)
    result = koebe_cem(mesh)
    assert not faults(koebe_cem.__cembench__, mesh, result.uv)
    metrics = all_metrics(mesh, result.uv)
    print(name, metrics)
    assert metrics["boundary_circularity"] < 1e-9
    if name == "alex_3holes.obj":
        assert metrics["angle_error_mean_deg"] < 1
    baseline = all_metrics(mesh, harmonic_filled(mesh).uv)
    assert metrics["angle_error_mean_deg"] < baseline["angle_error_mean_deg"]
    assert metrics["conformal_energy"] < baseline["conformal_energy"]


def test_more_sweeps_lower_the_energy_where_one_is_not_enough():
    mesh = read_mesh(real_mesh("holes/amoeba1.obj"), HoledMesh)
    energies = [
        all_metrics(mesh, koebe_cem(mesh, sweeps=sweeps).uv)["conformal_energy"]
        for sweeps in (1, 4)
    ]
    print(energies)
    assert energies[1] < energies[0] / 2
