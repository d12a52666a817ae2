"""Which seconds count, from figures alone."""

import numpy as np
import pytest

from cembench.registry import load_registry
from cembench.results.records import Fault, FaultKind, Round
from cembench.running.comparable import Used, impossible, incomparable, is_cold
from cembench.running.judge import Promise
from cembench.running.judging import Checked, judged_calls, sample
from cembench.running.motion import STRETCH, UNMOVED, motion, moved
from cembench.running.plan import generate_surface
from cembench.running.returned import hash_of

MORE, AHEAD = FaultKind.MORE_CORES, FaultKind.WORKS_AHEAD


@pytest.mark.parametrize(
    ("used", "running", "threads", "kinds"),
    [
        (Used(wall=1.0, own=1.0), (), 1, []),
        (Used(wall=1.0, own=1.5), (), 1, [MORE]),
        (Used(wall=1.0, own=1.5), (), 2, []),
        (Used(wall=1.0, others=2.9), (), 2, [MORE]),
        (Used(wall=0.001, own=0.003), (), 1, []),
        (Used(wall=0.01, others=0.02), (), 1, []),
        (Used(wall=1.0, own=0.4), (1, 2, 1, 1, 1, 1), 1, []),
        (Used(wall=1.0, own=0.4), (1, 8, 8, 1), 1, [MORE]),
        (Used(wall=1.0, own=0.4), (1, 8, 8, 1), 8, []),
        (Used(wall=1.0, own=0.9, beside=0.01), (), 1, []),
        (Used(wall=1.0, own=0.9, beside=0.2), (), 1, [AHEAD]),
        (Used(wall=1.0, own=0.9, beside=0.2), (), 2, []),
        (Used(wall=1.0, own=0.9, disturbed=4, looked=5), (), 1, [AHEAD]),
    ],
)
def test_more_cores_than_allowed_and_work_beside_the_calls_are_found(used, running, threads, kinds):
    assert [fault.kind for fault in incomparable(used, running, threads)] == kinds


@pytest.mark.parametrize(
    ("told", "is_refused"),
    [
        ({}, False),
        ({"own": -1.0}, True),
        ({"cold": -0.1}, True),
        ({"wall": 20.0}, True),
        ({"began": 90.0}, True),
        ({"ended": 120.0}, True),
    ],
)
def test_times_that_cannot_be_are_refused(told, is_refused):
    used = Used(**{"wall": 1.0, "cold": 1.0, "began": 101.0, "ended": 109.0} | told)
    found = impossible(used, Round(calls=(1.0,)), 100.0, 110.0)
    assert [f.kind for f in found] == [FaultKind.IMPOSSIBLE_TIMES] * is_refused


def test_a_first_call_far_above_the_later_ones_is_cold():
    assert is_cold([Round(calls=(0.1,), cold_seconds=0.2)]) is None
    assert is_cold([Round(calls=(0.001,), cold_seconds=0.02)]) is None
    assert is_cold([Round(calls=(0.1,))]) is None
    assert is_cold([Round(calls=(0.1,), cold_seconds=2.0)] * 3) == (2.0, 0.1)


MESH = generate_surface(load_registry(), "flat-disk", 200)
FLAT = MESH.V[:, 0] + 1j * MESH.V[:, 1]


def test_a_motion_is_seeded_tiny_and_no_rigid_one():
    matrix, shift = motion("a")
    np.testing.assert_array_equal(matrix, motion("a")[0])
    assert not np.array_equal(matrix, motion("b")[0])
    stretches = np.linalg.svd(matrix)[1]
    assert stretches[0] / stretches[-1] - 1 == pytest.approx(STRETCH, rel=0.1)
    assert np.abs(matrix - np.eye(3)).max() < 0.02
    assert np.abs(shift).max() <= 0.01
    surface = moved(MESH, "a")
    assert surface.hash != MESH.hash
    np.testing.assert_array_equal(surface.F, MESH.F)
    assert not np.shares_memory(surface.F, MESH.F)
    assert moved(MESH, UNMOVED).hash == MESH.hash


def judged(maps, known=None, repeats=None, **promise):
    checked = Checked(uv_hash=hash_of(FLAT), relative_energy=0.0)
    named = [(f"call {k}", motion, uv) for k, (motion, uv) in enumerate(maps, start=1)]
    known = {name: sample(uv) for name, uv in (known or {}).items()}
    return judged_calls(Promise(**promise), MESH, checked, named, known, repeats=repeats)


def turned(by):
    return FLAT * np.exp(1j * by)


def test_the_map_of_another_shape_is_a_kept_one_unless_no_coordinates_count():
    assert [f.kind for f in judged([("a", FLAT)]).kept] == [FaultKind.KEPT_RESULT]
    assert judged([("a", turned(1e-6)), ("b", turned(1e-6))]).kept
    assert judged([("a", FLAT), ("b", FLAT)], combinatorial=True).kept == ()
    assert judged([("a", turned(1e-6)), ("b", turned(2e-6))]).kept == ()


def test_the_same_surface_has_the_same_map_to_rounding_in_every_process():
    assert judged([(UNMOVED, FLAT)]).repeated is True
    assert judged([("a", turned(1e-6))], {"a": turned(1e-6 + 1e-12)}).repeated is True
    found = judged([("a", turned(1e-6))], {"a": turned(0.1)})
    assert (found.repeated, found.kept) == (False, ())
    found = judged([("a", turned(1e-6))], {"a": turned(3e-6)}, repeats=True)
    assert [f.kind for f in found.kept] == [FaultKind.KEPT_RESULT]
    found = judged([("a", turned(1e-6))], {"a": turned(3e-6)}, repeats=True, is_program=True)
    assert found.kept == ()


def test_a_worse_map_is_doubtful_until_a_fresh_process_has_made_it_too():
    worse = FLAT.copy()
    worse[MESH.interior] *= 0.99
    found = judged([("a", worse)], {UNMOVED: FLAT})
    assert (found.faults, found.doubtful) == ((), "a")
    assert judged([("a", worse)], {"a": worse}).faults == ()
    kinds = [f.kind for f in judged([("a", worse)], {"a": FLAT}).faults]
    assert kinds == [FaultKind.OTHER_MAP, FaultKind.OTHER_ENERGY]
    assert isinstance(judged([(UNMOVED, worse)]).faults[0], Fault)
