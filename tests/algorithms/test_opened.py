"""Surfaces with holes end in a valid map, and the last resort says what it did."""

import numpy as np
import pytest
from cembench.algorithms.direct_cem.holes import direct_cem_holes
from cembench.algorithms.direct_cem.opened import opened_disk, valid_with_holes
from cembench.surfaces.sheets import catenoid_ring

from cembench import HoledMesh
from cembench.conformal.metrics import (
    MapFigures,
    boundary_circles,
    boundary_circularity,
    flipped_triangles,
)
from cembench.conformal.planar import crossing_polygons
from cembench.core.notices import NoticeKind
from cembench.running.quality import quality_notes
from tests import gallery


def is_valid(mesh, uv):
    crossing = crossing_polygons([uv[loop] for loop in mesh.loops])
    return not flipped_triangles(mesh, uv) and crossing is None


def round_disk_with_an_eared_hole():
    """A disk with one hole, into which a triangle reaches, and the tip of that."""
    ring = HoledMesh.from_arrays(*gallery.annulus())
    _, (hole,) = ring.outer_and_holes()
    a, b = hole[:2]
    tip = 0.8 * (ring.V[a] + ring.V[b]) / 2
    V, F = np.vstack([ring.V, tip]), np.vstack([ring.F, [b, a, ring.n]])
    return HoledMesh.from_arrays(V, F), ring.n


def test_the_opened_disk_has_round_holes_and_no_folds():
    mesh = gallery.three_holes()
    _, holes = mesh.outer_and_holes()
    z = opened_disk(mesh, holes)
    assert is_valid(mesh, z)
    assert boundary_circularity(mesh, z) < 1e-12


def test_the_only_boundary_with_ears_is_the_outer_one():
    mesh, ear = round_disk_with_an_eared_hole()
    result = direct_cem_holes(mesh)
    assert abs(result.uv[ear]) == pytest.approx(1)
    assert is_valid(mesh, result.uv)
    assert boundary_circularity(mesh, result.uv) < 1e-12


def test_an_ear_on_a_hole_leaves_its_circle_and_does_not_fold():
    mesh, ear = gallery.eared_hole()
    outer, (hole,) = mesh.outer_and_holes()
    assert flipped_triangles(mesh, direct_cem_holes(mesh, outer=int(outer[0]), repair=False).uv)
    result = direct_cem_holes(mesh, outer=int(outer[0]))
    assert is_valid(mesh, result.uv)
    assert result.extras["folded_before_repair"] > 0
    others = result.uv[hole[hole != ear]]
    centre = np.abs(others - others.mean()).mean()
    assert np.abs(result.uv[ear] - others.mean()) < centre


def test_a_wrecked_map_is_replaced_and_the_note_tells():
    mesh = gallery.three_holes()
    outer, holes = mesh.outer_and_holes()
    wrecked = np.conj(direct_cem_holes(mesh).uv)
    uv, extras = valid_with_holes(mesh, (outer, *holes), wrecked, repair=True, last_resort=True)
    assert is_valid(mesh, uv)
    assert extras["last_resort"] == {"opened_holes": 3}
    assert extras["folded_before_repair"] == mesh.m
    note = quality_notes("circular holes", MapFigures(mesh, uv), extras)[0]
    assert note.kind is NoticeKind.LAST_RESORT
    assert "3 circles were cut out" in note.text
    kept, _ = valid_with_holes(mesh, (outer, *holes), wrecked, repair=True, last_resort=False)
    assert flipped_triangles(mesh, kept)


def test_a_valid_map_stays_as_it_is():
    mesh = catenoid_ring(400)
    own = direct_cem_holes(mesh, repair=False).uv
    outer, holes = mesh.outer_and_holes()
    uv, extras = valid_with_holes(mesh, (outer, *holes), own, repair=True, last_resort=True)
    assert uv is own
    assert extras == {"fold_repairs": 0, "folded_before_repair": 0}


def test_a_long_tube_is_an_annulus_whose_radius_the_record_holds():
    V, F = gallery.tube()
    mesh = HoledMesh.from_arrays(V * [1, 1, 5], F)
    result = direct_cem_holes(mesh)
    assert result.extras["stopped"] == "annulus"
    assert is_valid(mesh, result.uv)
    assert min(circle.radius for circle in boundary_circles(mesh, result.uv)) < 1e-3


@pytest.mark.parametrize("much_better", [False, True])
def test_the_last_resort_must_gain_a_tenth_over_a_repaired_map(monkeypatch, much_better):
    mesh = gallery.three_holes()
    outer, holes = mesh.outer_and_holes()
    good = direct_cem_holes(mesh).uv
    inside = np.setdiff1d(np.arange(mesh.n), np.concatenate([outer, *holes]))
    edge = np.median(np.abs(good[mesh.F[:, 1]] - good[mesh.F[:, 0]]))
    worse = good.copy()
    worse[inside] += 0.1 * edge * np.random.default_rng(4).standard_normal(len(inside))
    opened = good if much_better else worse
    monkeypatch.setattr("cembench.algorithms.direct_cem.opened.opened_disk", lambda *_: opened)
    own = worse.copy()
    own[inside[0]] = good[outer[0]]
    uv, extras = valid_with_holes(mesh, (outer, *holes), own, repair=True, last_resort=True)
    assert is_valid(mesh, uv)
    assert extras["folded_before_repair"] > 0
    assert ("last_resort" in extras) == much_better
