"""Which seconds count, from figures alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from cembench.registry import load_registry
from cembench.results.records import Fault, FaultKind, Round
from cembench.running import worker
from cembench.running.map_checks import Checked, judged_calls, kept_from_call_to_call, sample
from cembench.running.map_promises import Promise
from cembench.running.rigid_motion import (
    BLOCKS,
    DRAWN_LATER,
    NUMBERS_KEPT,
    STRETCH,
    THEN,
    UNMOVED,
    drawn,
    in_first_order,
    may_be,
    motion,
    moved,
    numbering,
)
from cembench.running.sanitized_result import hash_of
from cembench.running.surfaces import generate_surface
from cembench.running.timing_checks import Used, impossible, incomparable, is_cold

MORE, AHEAD = FaultKind.MORE_CORES, FaultKind.WORKS_AHEAD
#: Something ran before most calls.
OFTEN = {"wall": 0.1, "own": 0.1, "disturbed": 4, "looked": 5, "between": 0.02}


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
        (Used(wall=0.03, own=0.03), (1, 2, 1, 1, 2, 1, 1), 1, []),
        (Used(wall=1.0, own=0.4, helping=0.4), (1, 8, 8, 8, 8, 1), 1, [MORE]),
        (Used(wall=1.0, own=0.4, helping=0.4), (1, 8, 8, 8, 8, 1), 8, []),
        (Used(wall=1.0, own=0.4, helping=0.01), (1, 2, 2, 2, 2, 1), 1, []),
        (Used(wall=1.0, own=0.9, beside=0.01), (), 1, []),
        (Used(wall=1.0, own=0.9, beside=0.2), (), 1, [AHEAD]),
        (Used(wall=1.0, own=0.9, beside=0.2), (), 2, []),
        (Used(**OFTEN, beside=0.003), (), 1, [AHEAD]),
        (Used(**OFTEN, beside=0.0002), (), 1, []),
        (Used(wall=2.0, own=0.4, between=0.5), (), 1, [AHEAD]),
        (Used(wall=1.0, own=0.9, between=0.4), (), 1, []),
        (Used(wall=1.0, own=0.9, between=0.9, cold=1.0), (), 1, []),
        (Used(wall=1.0, own=0.9, between=0.7, preparing=0.1), (), 1, []),
        (Used(wall=1.0, own=0.9, between=0.9, preparing=0.1), (), 2, [AHEAD]),
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
    faults = impossible(used, Round(calls=(1.0,)), 100.0, 110.0)
    assert [f.kind for f in faults] == [FaultKind.IMPOSSIBLE_TIMES] * is_refused


def test_cpu_seconds_that_the_system_knows_of_and_the_process_does_not_are_refused():
    used = Used(wall=1.0, cold=1.0, began=101.0, ended=109.0, everything=2.0)
    for cpu, is_refused in ((0.0, False), (2.2, False), (0.1, False), (3.0, True)):
        faults = impossible(used, Round(calls=(1.0,)), 100.0, 110.0, cpu)
        assert [f.kind for f in faults] == [FaultKind.IMPOSSIBLE_TIMES] * is_refused


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
    surface = moved(MESH, f"a{NUMBERS_KEPT}")
    assert surface.hash != MESH.hash
    np.testing.assert_array_equal(surface.F, MESH.F)
    assert not np.shares_memory(surface.F, MESH.F)
    assert moved(MESH, UNMOVED).hash == MESH.hash


def test_a_motion_is_drawn_when_its_call_begins_and_known_by_its_name():
    open_, kept = DRAWN_LATER, f"{DRAWN_LATER}{NUMBERS_KEPT}"
    names = {drawn(open_), drawn(open_), drawn(kept)}
    assert len(names) == 3
    assert may_be(drawn(open_), open_)
    assert may_be(drawn(kept), kept)
    assert not may_be(drawn(kept), open_)
    assert not may_be(drawn(open_), kept)
    assert not may_be("mine", open_)
    assert drawn("known") == "known"
    assert may_be("known", "known")
    assert not may_be(drawn(open_), "known")


def test_a_renumbered_surface_is_the_same_surface_with_all_numbers_changed():
    surface = moved(MESH, "a")
    vertices, triangles, turns = numbering("a", MESH.n, MESH.m)
    assert sorted(vertices) == list(range(MESH.n))
    assert sorted(triangles) == list(range(MESH.m))
    assert set(turns) == {0, 1, 2}
    assert not np.array_equal(numbering("b", MESH.n, MESH.m)[0], vertices)
    plain = motion("a")[0]
    X = surface.V - surface.V.mean(axis=0)
    np.testing.assert_allclose(X, ((MESH.V - MESH.V.mean(axis=0)) @ plain.T)[vertices], atol=1e-14)
    back = vertices[surface.F]
    own = [np.roll(row, -by) for row, by in zip(MESH.F[triangles], turns, strict=True)]
    np.testing.assert_array_equal(back, own)
    assert type(MESH)(surface.V, surface.F).m == MESH.m  # it passes all checks
    np.testing.assert_array_equal(in_first_order(FLAT[vertices], MESH, "a"), FLAT)


def test_motions_may_share_a_numbering():
    """Seconds depend on the numbering: cells that are compared get the same one."""
    first, second = (drawn(f"a{THEN}{DRAWN_LATER}") for _ in range(2))
    np.testing.assert_array_equal(moved(MESH, first).F, moved(MESH, second).F)
    assert moved(MESH, first).hash != moved(MESH, second).hash
    assert not np.array_equal(moved(MESH, first).F, moved(MESH, drawn(f"b{THEN}{DRAWN_LATER}")).F)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 100, 10_000])
def test_numbers_are_permuted_in_blocks_that_no_single_shift_undoes(count):
    for name in "abcdef":
        order, _, turns = numbering(name, count, count)
        assert sorted(order) == list(range(count))
        assert len(turns) == count
        neighbours = np.count_nonzero(np.diff(order) == 1)
        if count >= 100:
            assert neighbours == count - BLOCKS  # what was near stays near
            shifts = np.bincount((np.arange(count) - order) % count)
            assert shifts.max() < 0.35 * count


def test_an_algorithm_is_imported_before_its_process_knows_the_surface(tmp_path, monkeypatch):
    """Its module could prepare for what is to be mapped while no clock runs."""
    job = worker.Job.model_construct(
        parts=(),
        mesh_files=(tmp_path / "V.npy", tmp_path / "F.npy"),
        plugins=("mine",),
        cell=None,
        motions=("a",),
    )
    np.save(job.mesh_files[0], MESH.V)
    np.save(job.mesh_files[1], MESH.F)
    called = []

    def stop(_):
        called.append("surface")
        raise InterruptedError

    part = SimpleNamespace(
        cell=SimpleNamespace(algorithm="mine"), plugins=(), motions=(), first_counts=True, untimed=1
    )
    monkeypatch.setattr(worker, "load_algorithm", lambda *_: called.append("algorithm"))
    monkeypatch.setattr(worker, "_mesh", stop)
    made = job.model_copy(update={"parts": (part,), "cell": part.cell})
    for run in (worker._time, worker._check):
        called.clear()
        with pytest.raises(InterruptedError):
            run(made)
        assert called == ["algorithm", "surface"]


def judged(maps, known=None, **promise):
    """Judge maps that are given in the surface's own order."""
    checked = Checked(uv_hash=hash_of(FLAT), relative_energy=0.0)
    maps = [(name, uv[numbering(name, MESH.n, MESH.m)[0]]) for name, uv in maps]
    named = [(f"call {k}", motion, uv) for k, (motion, uv) in enumerate(maps, start=1)]
    known = {name: sample(uv) for name, uv in (known or {}).items()}
    return judged_calls(Promise(**promise), MESH, checked, named, known)


def turned(by):
    return FLAT * np.exp(1j * by)


def stretched(by):
    return FLAT + by * FLAT.conj() * (1 - abs(FLAT) ** 2)


def test_the_map_of_another_shape_is_a_kept_one_unless_no_coordinates_count():
    a, b = f"a{NUMBERS_KEPT}", f"b{NUMBERS_KEPT}"
    assert [f.kind for f in judged([(a, FLAT)]).kept] == [FaultKind.KEPT_RESULT]
    assert judged([(a, turned(1e-6)), (b, turned(1e-6))]).kept
    assert judged([(a, FLAT), (b, FLAT)], combinatorial=True).kept == ()
    assert judged([("a", turned(1e-6)), ("b", stretched(1e-6))]).kept == ()


def test_a_map_that_was_turned_and_put_into_other_numbers_is_a_kept_one():
    assert [f.kind for f in judged([("a", FLAT), ("b", turned(1e-6))]).kept] == [
        FaultKind.KEPT_RESULT
    ]
    assert judged([("a", turned(1e-6))], {"b": FLAT}).kept
    assert judged([("a", FLAT), ("b", turned(1e-6))], combinatorial=True).kept == ()
    assert judged([("a", FLAT), ("b", stretched(1e-9))]).kept == ()
    by_chance = [("a", FLAT), ("b", stretched(1e-7)), ("c", turned(1e-6))]
    assert judged(by_chance).kept == ()
    assert judged([*by_chance, ("d", turned(2e-6))]).kept


def test_the_same_surface_has_the_same_map_to_rounding_in_every_process():
    assert judged([(UNMOVED, FLAT)]).repeated is True
    assert judged([("a", turned(1e-6))], {"a": turned(1e-6 + 1e-12)}).repeated is True
    result = judged([("a", turned(1e-6))], {"a": turned(0.1)})
    assert (result.repeated, result.kept) == (False, ())
    assert result.difference == pytest.approx(0.1, rel=1e-2)
    assert not result.differs  # a turn explains it
    assert judged([("a", turned(1e-6))], {"a": turned(1e-6) + 3e-7 * FLAT**2}).differs


@pytest.mark.parametrize(
    ("apart", "scatter", "is_kept"),
    [
        *((1e-9, 0.0, False), (1e-6, 0.0, True), (1e-6, 1e-8, True)),
        *((1e-6, 3e-7, False), (5e-2, 1e-3, True), (5e-3, 1e-3, False)),
    ],
)
def test_maps_of_used_processes_may_differ_as_far_as_those_of_fresh_ones(apart, scatter, is_kept):
    fault = kept_from_call_to_call(apart, scatter)
    assert (fault is not None and fault.kind is FaultKind.KEPT_RESULT) == is_kept


def test_a_map_that_is_far_worse_is_not_the_one_that_was_checked_though_it_is_repeated():
    worse = FLAT.copy()
    worse[MESH.interior] *= 0.8
    result = judged([("a", worse)], {"a": worse})
    assert (result.faults, [f.kind for f in result.kept]) == ((), [FaultKind.OTHER_ENERGY])
    assert result.energy > 1e-3


def test_a_worse_map_is_doubtful_until_a_fresh_process_has_made_it_too():
    worse = FLAT.copy()
    worse[MESH.interior] *= 0.99
    result = judged([("a", worse)], {UNMOVED: FLAT})
    assert (result.faults, result.doubtful) == ((), "a")
    assert judged([("a", worse)], {"a": worse}).faults == ()
    assert judged([("a", worse)], {"a": worse}).kept == ()
    kinds = [f.kind for f in judged([("a", worse)], {"a": FLAT}).faults]
    assert kinds == [FaultKind.OTHER_MAP, FaultKind.OTHER_ENERGY]
    assert isinstance(judged([(UNMOVED, worse)]).faults[0], Fault)
