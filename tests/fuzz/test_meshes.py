"""The oracle for maps: right maps pass it, and what is planted is found."""

from types import SimpleNamespace

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, HoledMesh
from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry
from tests import gallery
from tests.campaign.exact import circles_out_of_place, faults_of_map, overlaps
from tests.campaign.hard_meshes import FAMILIES, hard_mesh
from tests.campaign.meshes import judge_mesh
from tests.campaign.slow_metrics import conformal_energy, mean_angle_error

ALGORITHMS = load_registry().algorithms


def double_cover(turns=12):
    """A ring of triangles, cut open, whose map winds twice round the disk: nothing is folded."""
    t = 2 * np.pi * np.arange(2 * turns + 1) / turns
    z = np.concatenate([np.exp(1j * t), 0.5 * np.exp(1j * t)])
    k = len(t)
    F = [f for i in range(k - 1) for f in ([i, i + 1, k + i], [i + 1, k + i + 1, k + i])]
    V = np.stack([np.r_[t, t], np.r_[0 * t, 0 * t + 1], np.zeros(2 * k)], axis=1)
    return V, np.array(F), z


def branched_cover(k=12):
    """A cone over a circle that is run through twice: its tip is a branch point."""
    z = np.r_[0, np.exp(4j * np.pi * np.arange(k) / k)]
    F = np.array([[0, 1 + i, 1 + (i + 1) % k] for i in range(k)])
    V = np.stack([z.real, z.imag, np.r_[0, np.arange(k)]], axis=1)
    return V, F, z


def faults(F, uv, target="disk"):
    return faults_of_map(uv.tolist(), [tuple(face) for face in F.tolist()], target)


def test_a_right_map_has_no_faults():
    mesh = flat_disk(200)
    uv = ALGORITHMS["harmonic-circle"].function(mesh).uv
    assert faults(mesh.F, uv) == []
    turned = uv * np.exp(2j)
    assert faults(mesh.F, turned / np.abs(turned).max()) == []


def test_a_right_map_with_holes_has_no_faults():
    mesh = gallery.three_holes(400)
    uv = ALGORITHMS["koebe-cem"].function(mesh).uv
    assert faults(mesh.F, uv, "circular holes") == []


def test_a_double_cover_is_found_without_a_fold():
    _, F, z = branched_cover()
    assert faults(F, z) == [
        "along the boundary the angle falls 2 times, not once",
        "a triangle's image is covered 2 times",
    ]


def test_a_free_boundary_that_covers_itself_is_found():
    _, F, z = double_cover()
    assert faults(F, z, "free boundary") == []
    assert overlaps(z.tolist(), [tuple(face) for face in F.tolist()])


def circle(vertices=12):
    uv = np.r_[0, np.exp(2j * np.pi * np.arange(vertices) / vertices)]
    F = np.array([[0, 1 + i, 1 + (i + 1) % vertices] for i in range(vertices)])
    return F, uv


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda uv: np.conj(uv), "not counter-clockwise"),
        (lambda uv: uv * (1 + 1e-8), "not on the unit circle"),
        (lambda uv: np.r_[uv[0], uv[2], uv[1], uv[3:]], "not counter-clockwise"),
        (lambda uv: np.r_[uv[:2], uv[1], uv[3:]], "same angle"),
        # Left of its neighbour by less than rounding would show.
        (lambda uv: np.r_[uv[:2], uv[1] * (1 - 2**-40), uv[3:]], "same angle|not counter"),
    ],
)
def test_each_fault_of_a_disk_is_found(change, words):
    F, uv = circle()
    assert faults(F, uv) == []
    joined = "; ".join(faults(F, change(uv)))
    assert any(word in joined for word in words.split("|")), joined


def test_holes_that_cross_or_lie_outside_are_found():
    mesh = gallery.three_holes(400)
    uv = ALGORITHMS["koebe-cem"].function(mesh).uv
    _, holes = mesh.outer_and_holes()
    moved = uv.copy()
    moved[holes[0]] = moved[holes[0]] - moved[holes[0]].mean() + uv[holes[1]].mean()
    (found,) = circles_out_of_place(moved.tolist(), mesh.F.tolist())
    assert found == "the circles of two holes overlap"
    moved[holes[0]] += 3
    assert "a hole lies outside" in faults(mesh.F, moved, "circular holes")


def check_that_says_ok(uv, metrics=None, notes=()):
    def check(algorithm, mesh):
        found = metrics if metrics is not None else all_metrics(mesh, uv)
        return SimpleNamespace(status="ok", cause=None, notes=notes, metrics=found), uv

    return check


def test_a_judge_that_calls_a_double_cover_ok_is_found():
    V, F, z = branched_cover()
    verdict = judge_mesh(V, F, ALGORITHMS["cem"], check_that_says_ok(z))
    assert (verdict.outcome, verdict.fault) == ("ok", "wrong ok")


def test_an_overlap_must_be_told():
    V, F, z = double_cover()
    lscm = ALGORITHMS["lscm"]
    assert judge_mesh(V, F, lscm, check_that_says_ok(z)).fault == "untold overlap"
    assert judge_mesh(V, F, lscm, check_that_says_ok(z, notes=("it overlaps",))).fault is None


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({}, None),
        ({"conformal_energy": 1e-6}, "wrong figure"),
        ({"angle_error_mean_deg": 1e-3}, "wrong figure"),
        ({"dilatation_max": None}, "untold figure"),
    ],
)
def test_wrong_and_missing_figures_are_found(change, fault):
    mesh = gallery.hill_in_a_corner()
    mesh = DiskMesh.from_arrays(*mesh)
    uv = ALGORITHMS["cem"].function(mesh).uv
    metrics = all_metrics(mesh, uv)
    for name, off in change.items():
        metrics[name] = None if off is None else metrics[name] + off
    check = check_that_says_ok(uv, metrics)
    assert judge_mesh(mesh.V, mesh.F, ALGORITHMS["cem"], check).fault == fault


def test_the_harness_and_the_oracle_agree_on_a_plain_disk():
    mesh = flat_disk(100)
    verdict = judge_mesh(mesh.V, mesh.F, ALGORITHMS["cem"])
    assert (verdict.outcome, verdict.fault) == ("ok", None)
    assert judge_mesh(mesh.V, mesh.F, ALGORITHMS["koebe-cem"]).outcome == "skipped"


@pytest.mark.parametrize(
    ("about", "fault"),
    [
        ({"status": "failed", "cause": "it gave up", "traceback": None}, None),
        ({"status": "failed", "cause": "KeyError", "traceback": "KeyError: 1"}, "traceback"),
        ({"status": "invalid", "cause": None, "traceback": None}, "no message"),
        ({"status": "out_of_memory", "cause": "refused", "traceback": None}, "memory"),
    ],
)
def test_what_is_not_ok_needs_a_cause_and_no_traceback(about, fault):
    mesh = flat_disk(100)

    def check(algorithm, mesh):
        return SimpleNamespace(**about), None

    assert judge_mesh(mesh.V, mesh.F, ALGORITHMS["cem"], check).fault == fault


def test_the_slow_figures_are_the_fast_ones_on_good_meshes():
    mesh = gallery.crumpled_disk()
    uv = ALGORITHMS["harmonic-circle"].function(mesh).uv
    V, F = mesh.V.tolist(), mesh.F.tolist()
    fast = all_metrics(mesh, uv)
    energy, angle = conformal_energy(V, F, uv.tolist()), mean_angle_error(V, F, uv.tolist())
    assert energy.value == pytest.approx(fast["conformal_energy"], rel=1e-9)
    assert angle.value == pytest.approx(fast["angle_error_mean_deg"], rel=1e-9)
    assert energy.bound < 1e-8
    assert angle.bound < 1e-6


@pytest.mark.parametrize("number", range(len(FAMILIES)))
def test_each_family_repeats_itself(number):
    family, V, F = hard_mesh(5, number)
    again = hard_mesh(5, number)
    assert family == list(FAMILIES)[number]
    np.testing.assert_array_equal(V, again[1])
    np.testing.assert_array_equal(F, again[2])


@pytest.mark.parametrize("family", ["close holes", "round holes"])
def test_the_holed_families_have_holes(family):
    numbers = [list(FAMILIES).index(family) + k * len(FAMILIES) for k in range(5)]
    meshes = [HoledMesh.from_arrays(*hard_mesh(1, number)[1:]) for number in numbers]
    assert max(len(mesh.loops) for mesh in meshes) > 2
