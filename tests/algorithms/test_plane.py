import pytest
from cembench.algorithms.best.plane import plane, plane_holes
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.catalogue import nefertiti
from cembench.surfaces.holed_disk import holed_disk
from cembench.surfaces.sheets import swiss_roll

import cembench
from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.conformal.planar import bounds_once
from cembench.core.notices import NoticeKind
from tests import gallery
from tests.hard_surfaces import hard_surface


def is_valid(mesh, z):
    return bounds_once([z[loop] for loop in mesh.loops]) and not flipped_triangles(mesh, z)


@pytest.mark.parametrize(
    "mesh", [hard_surface(1), hard_surface(4), swiss_roll(2000), nefertiti()], ids=lambda m: m.name
)
def test_it_neither_folds_nor_overlaps_and_has_better_angles_than_the_disk(mesh):
    result = plane(mesh)
    assert is_valid(mesh, result.uv)
    errors = [angle_errors(mesh, one.uv).mean() for one in (result, direct_cem(mesh))]
    assert errors[0] < errors[1]


def test_of_the_algorithms_it_takes_the_one_with_the_least_error_or_the_more_even_of_equals():
    mesh = nefertiti()
    result = plane(mesh)
    tried = result.extras["tried"]
    assert set(tried) == {"bff-free", "abf-linear"}
    least = min(one["angle_error_mean_deg"] for one in tried.values())
    chosen = tried[result.extras["chosen"]]
    assert angle_errors(mesh, result.uv).mean() == chosen["angle_error_mean_deg"] <= 1.01 * least
    alone = plane(mesh, work=mesh.m)
    assert alone.extras["chosen"] == "bff-free"
    assert "needs work=" in alone.extras["tried"]["abf-linear"]


def test_holes_stay_holes():
    mesh = holed_disk(1500)
    result = plane_holes(mesh)
    assert is_valid(mesh, result.uv)
    assert angle_errors(mesh, result.uv).mean() < 1e-6  # it is flat
    assert "instead_of" not in result.extras


def test_a_tube_that_no_free_boundary_lays_flat_is_mapped_to_the_disk_and_told():
    V, F = gallery.tube()
    result = cembench.parameterize((V, F))
    assert result.algorithm.name == "plane-holes"
    assert result.extras["chosen"] == "direct-cem-holes"
    assert is_valid(result.mesh, result.z)
    assert result.metrics["image_area"] == pytest.approx(3.14159265)
    assert result.energy_history == ()  # those of the disk are at another scale
    note = next(n for n in result.outcome.notes if n.kind is NoticeKind.LAST_RESORT)
    assert "a map with a free boundary is not valid here, or worse (lscm: " in note.text


@pytest.mark.parametrize(
    ("target", "surface", "name"),
    [
        (None, "cone", "plane"),
        ("plane", "holed-disk", "plane-holes"),
        ("disk", "cone", "direct-cem"),
        ("disk", "holed-disk", "direct-cem-holes"),
        ("circular holes", "holed-disk", "direct-cem-holes"),
    ],
)
def test_a_target_stands_for_the_algorithm_that_is_recommended(target, surface, name):
    mesh = cembench.surface(surface, 600)
    assert cembench.parameterize(mesh, target=target).algorithm.name == name


def test_a_target_does_not_go_with_an_algorithm_or_another_surface():
    mesh = cembench.surface("cone", 300)
    with pytest.raises(cembench.ParameterError, match="exclude each other"):
        cembench.parameterize(mesh, "cem", target="disk")
    with pytest.raises(
        cembench.ParameterError, match="target='plain' is unknown; allowed: 'plane'"
    ):
        cembench.parameterize(mesh, target="plain")
    with pytest.raises(cembench.MeshError, match="hole"):
        cembench.parameterize(mesh, target="circular holes")
