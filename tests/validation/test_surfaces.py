import numpy as np
import pytest

from cembench import DiskMesh, HoledMesh
from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry
from cembench.validation import surfaces

KNOWN = [
    one
    for kind in (DiskMesh, HoledMesh)
    for one in surfaces.refined(load_registry(), kind)
    if one.exact_map is not None
]


@pytest.mark.parametrize("one", KNOWN, ids=lambda one: one.name)
def test_a_declared_exact_map_is_conformal_in_the_limit(one):
    figures = [all_metrics(mesh, one.exact_map(mesh.V)) for mesh in one.meshes]
    energies = [f["conformal_energy"] / f["image_area"] for f in figures]
    sizes = [mesh.m**-0.5 for mesh in one.meshes]
    order = np.polyfit(np.log(sizes), np.log(energies), 1)[0]
    assert order > 1.7, energies
    assert all(f["flipped_triangles"] == 0 for f in figures)


def test_the_closed_forms_with_a_known_map_are_among_them():
    assert {one.name for one in KNOWN} == {"spherical-cap", "catenoid-ring", "holed-cap"}


@pytest.mark.parametrize("kind", [DiskMesh, HoledMesh])
def test_the_same_surface_given_another_way_has_the_same_metric(kind):
    mesh = surfaces.uneven(load_registry(), kind)
    other, number = surfaces.renumbered(mesh)
    assert np.array_equal(other.V[number], mesh.V)
    assert other.m == mesh.m
    moved = surfaces.moved(mesh)
    i, j = mesh.F[:, 0], mesh.F[:, 1]
    lengths = np.linalg.norm(mesh.V[i] - mesh.V[j], axis=1)
    assert np.linalg.norm(moved.V[i] - moved.V[j], axis=1) == pytest.approx(40 * lengths)


def test_awkward_meshes_are_what_they_are_called():
    fan, strip, slanted = surfaces.awkward(load_registry(), DiskMesh)
    assert len(fan.interior) == 1
    assert len(strip.interior) == 0
    assert slanted.m > 500


def test_six_surfaces_are_compared_on_so_that_there_is_an_interval():
    for kind in (DiskMesh, HoledMesh):
        assert len(surfaces._COMPARED[kind]) == 6
