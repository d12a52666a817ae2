"""How far from conformal is a valid map, judged on its own mesh?"""

from dataclasses import replace

import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.algorithms.direct_cem.holes import direct_cem_holes
from cembench.algorithms.harmonic_circle import harmonic_circle
from cembench.algorithms.harmonic_filled import harmonic_filled
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

import cembench
from cembench import DiskMesh
from cembench.conformal.metrics import MapFigures, angle_errors
from cembench.core.notices import NoticeKind, of_kind
from cembench.mesh.triangle_mesh import HoledMesh, TriangleMesh
from cembench.registry import load_registry
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.quality import (
    COMPARED,
    POOR,
    collapsed_error,
    free_map,
    likely_causes,
    quality_notes,
    yardstick,
)
from tests import gallery
from tests.hard_surfaces import hard_surface


def warped():
    mesh = gallery.three_holes()
    z = np.exp(0.8 * (mesh.V[:, 0] + 1j * mesh.V[:, 1]))
    return HoledMesh.from_arrays(np.stack([z.real, z.imag, 0 * z.real], axis=1), mesh.F)


def eared_disk(count=15, length=8):
    """A flat disk with ears: triangles that hang on one boundary edge."""
    mesh = flat_disk(200)
    V, F = [*mesh.V], [*mesh.F]
    for k in range(count):
        a, b = mesh.boundary[2 * k], mesh.boundary[2 * k + 1]
        F.append([b, a, len(V)])
        V.append(length * (mesh.V[a] + mesh.V[b]) / 2)
    return DiskMesh.from_arrays(np.array(V), np.array(F))


@pytest.mark.parametrize("mesh", [hemi_ellipsoid(800, x=2.0), flat_disk(600, stretch=4.0)])
def test_the_yardstick_is_nearly_as_good_as_the_best_method(mesh):
    best = angle_errors(mesh, direct_cem(mesh).uv).mean()
    assert (
        angle_errors(mesh, yardstick("disk", MapFigures(mesh, direct_cem(mesh).uv))).mean()
        < 1.5 * best
    )


def notes_on(target, mesh, uv, extras):
    return quality_notes(target, MapFigures(mesh, uv), extras)


@pytest.mark.parametrize("algorithm", [cem, direct_cem])
def test_conformal_maps_get_no_note(algorithm):
    mesh = hemi_ellipsoid(800, x=2.0)
    result = algorithm(mesh)
    assert notes_on("disk", mesh, result.uv, result.extras) == []


def test_a_map_with_hardly_any_angle_error_is_not_compared(monkeypatch):
    monkeypatch.setattr("cembench.running.quality.yardstick", lambda *_: pytest.fail("compared"))
    mesh = flat_disk(600)
    assert notes_on("disk", mesh, mesh.V[:, 0] + 1j * mesh.V[:, 1], {}) == []


def test_a_map_by_arc_length_of_a_long_surface_is_far_from_conformal():
    mesh = flat_disk(600, stretch=4.0)
    (note,) = notes_on("disk", mesh, harmonic_circle(mesh).uv, {})
    assert note.kind is NoticeKind.FAR_FROM_CONFORMAL
    assert "the method, not the mesh" in note.text
    rival = angle_errors(mesh, cetm_flips(mesh).uv).mean()
    assert f"but it can be {rival:.2f} by cetm-flips" in note.text
    assert note.text.endswith("Take -a best, which tries several algorithms")


def test_a_repair_of_folds_that_costs_more_than_a_degree_is_told():
    mesh = flat_disk(200, stretch=1.2)
    uv = direct_cem(flat_disk(200)).uv
    error = angle_errors(mesh, uv).mean()
    for cost, count in ((0.9, 0), (1.1, 1)):
        before = {"angle_error_mean_deg": error - cost}
        extras = {"fold_repairs": 2, "folded_before_repair": 7, "before_repair": before}
        notes = notes_on("disk", mesh, uv, extras)
        assert len(of_kind(NoticeKind.LAST_RESORT, notes)) == count
    assert "7 folds, and their repair costs 1.10 degrees" in notes[0].text
    assert f"{error:.2f} instead of {error - 1.1:.2f}" in notes[0].text


def test_with_holes_the_yardstick_has_the_same_boundary_outside():
    mesh = warped()
    result = direct_cem_holes(mesh)
    assert notes_on("circular holes", mesh, result.uv, result.extras) == []
    hole = mesh.outer_and_holes()[1][0]
    turned = harmonic_filled(mesh, outer=int(hole[0])).uv
    known = yardstick("circular holes", MapFigures(mesh, turned))
    assert abs(abs(known[hole]) - 1).max() < 1e-12


def test_where_the_first_iteration_ends_cem_on_a_rise_a_much_better_stop_is_named():
    mesh = hemi_ellipsoid(6400)
    (notice,) = cembench.parameterize(mesh, "cem").outcome.notes
    assert notice.kind is NoticeKind.BETTER_PARAMETERS
    errors = [angle_errors(mesh, cem(mesh, stop=stop).uv).mean() for stop in ("drop", "change")]
    assert errors[1] < 0.9 * errors[0]
    assert "-p cem.stop=change" in notice.text
    assert f"{errors[0]:.3g}" in notice.text
    assert f"{errors[1]:.3g}" in notice.text
    assert not cembench.parameterize(mesh, "cem", stop="change").outcome.notes


def test_a_rise_without_a_better_stop_is_not_told():
    mesh = hard_surface(1)
    result = cembench.parameterize(mesh, "cem", keep_invalid=True)
    assert "alternative" in result.extras
    kinds = {notice.kind for notice in result.outcome.notes}
    assert NoticeKind.BETTER_PARAMETERS not in kinds


@pytest.mark.parametrize("suggested", [{"stop": "never"}, {"no such": 1}, "stop", {}])
def test_a_suggestion_that_is_none_is_passed_over(suggested):
    def found(mesh, **parameters):
        return cembench.Parameterization(uv, extras={"alternative": suggested})

    mesh = flat_disk(200)
    uv = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    spec = replace(load_registry().algorithm("cem"), function=found)
    task = plan_cells([spec], [mesh], {}, MeasurementSettings(repeats=1))[0]
    outcome, _ = check_cell(spec, task.mesh, task.cell)
    assert (outcome.status, outcome.notes) == ("ok", ())


def test_a_crowded_end_is_never_passed_over():
    mesh = spherical_cap(300)
    uv = direct_cem(mesh).uv
    note = notes_on("disk", mesh, uv, {"stopped": "crowded"})[0]
    assert note.kind is NoticeKind.CROWDED_BOUNDARY


def test_causes_are_those_of_the_mesh_and_of_the_map():
    mesh = eared_disk()
    needles = likely_causes(mesh, direct_cem(mesh).uv, {})
    assert needles[0].startswith("needles (")  # the ears are long
    mesh = eared_disk(length=1.3)
    causes = likely_causes(mesh, direct_cem(mesh).uv, {"fold_repairs": 3})
    assert "Definition 1" in causes[0]
    assert "3 solves" in causes[1]
    sound = flat_disk(200)
    assert likely_causes(sound, sound.V[:, 0] + 1j * sound.V[:, 1], {}) == []


def test_a_map_that_is_nearly_collapsed_is_told_even_where_the_yardstick_is_no_better(monkeypatch):
    mesh = flat_disk(200)
    flat = mesh.V[:, 0] + 1e-3j * mesh.V[:, 1]
    assert angle_errors(mesh, flat).mean() == pytest.approx(
        collapsed_error(MapFigures(mesh, flat)), rel=0.3
    )
    monkeypatch.setattr("cembench.running.quality.yardstick", lambda *_: flat)
    monkeypatch.setattr("cembench.running.quality.free_map", lambda _: (np.inf, ""))
    (note,) = notes_on("disk", mesh, flat, {})
    assert "degrees, by cetm-flips" in note.text
    assert "too coarse" in note.text
    monkeypatch.setattr("cembench.running.quality.next_candidate", lambda _: np.inf)
    monkeypatch.setattr("cembench.running.quality.yardstick", lambda *_: None)
    (note,) = notes_on("disk", mesh, flat, {})
    assert "and no other map was computed" in note.text
    assert "Take -a best" in note.text


@pytest.mark.parametrize("algorithm", ["direct-cem", "bff", "cetm-flips", "harmonic-circle"])
def test_a_surface_too_long_for_a_disk_is_told_by_its_free_boundary(algorithm):
    """All disk maps are above 10 degrees, and so is the yardstick."""
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(3, 60))
    assert free_map(mesh)[0] < 1e-6
    result = cembench.parameterize(mesh, algorithm)
    assert result.metrics["angle_error_mean_deg"] > POOR
    notes = of_kind(NoticeKind.FAR_FROM_CONFORMAL, result.outcome.notes)
    assert len(notes) == 1
    assert "cause: the surface is too long" in notes[0].text  # not its ears, which lscm has, too
    assert not cembench.parameterize(mesh, algorithm, check="fast").outcome.notes


def test_a_free_boundary_is_mapped_only_above_the_stated_angle_error(monkeypatch):
    monkeypatch.setattr("cembench.running.quality.free_map", lambda _: pytest.fail("mapped"))
    mesh = hemi_ellipsoid(200)
    assert 1 < angle_errors(mesh, direct_cem(mesh).uv).mean() < COMPARED
    assert notes_on("disk", mesh, direct_cem(mesh).uv, {}) == []


def test_a_poor_map_of_a_disk_whose_free_boundary_is_good_names_it(monkeypatch):
    mesh = flat_disk(200)
    poor = harmonic_circle(flat_disk(200, stretch=2.2)).uv
    assert COMPARED < angle_errors(mesh, poor).mean() < POOR
    monkeypatch.setattr("cembench.running.quality.yardstick", lambda *_: poor)
    (note,) = notes_on("disk", mesh, poor, {})
    assert "with a free boundary, as of -a lscm, it is" in note.text
    assert "Take --target plane" in note.text


def test_the_free_map_of_a_flat_surface_with_holes_is_itself():
    assert free_map(gallery.three_holes())[0] < 1e-6
    assert 0.1 < free_map(hemi_ellipsoid(200))[0] < COMPARED
    assert free_map(TriangleMesh.from_arrays(*gallery.tetrahedron()))[0] == np.inf


def test_a_free_boundary_has_no_yardstick():
    mesh = flat_disk(200)
    assert yardstick("free boundary", MapFigures(mesh, mesh.V[:, 0] + 0j)) is None
