import dataclasses
import re
from collections import Counter
from contextlib import closing
from itertools import groupby
from pathlib import Path

import numpy as np
import psutil
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.core.errors import RecordError
from cembench.core.notices import NoticeKind
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.results.records import FaultKind
from cembench.results.store import Store
from cembench.running.environment import ALLOCATOR, describe_environment, for_measuring
from cembench.running.fork_server import can_fork
from cembench.running.local import map_once, run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.schedule import CellState, in_random_order
from cembench.running.timing import CellTimer
from cembench.running.watcher import Watcher
from tests.limits import files_of_at_most

FAULTY = str(Path(__file__).with_name("faulty.py"))
pytestmark = pytest.mark.usefixtures("kept_servers")
MEMORY = 500 * 2**20


def tasks_of(*names, faces=600, **how):
    registry = load_registry([FAULTY])
    chosen = [registry.algorithm(name) for name in names]
    return plan_cells(
        chosen, [flat_disk(faces)], {}, MeasurementSettings(**{"repeats": 1, **how}), [FAULTY]
    )


@pytest.mark.parametrize(
    ("name", "status", "cause"),
    [
        ("segfaults", "failed", "signal SIGSEGV"),
        ("exits", "failed", "ended with code 7: the last words"),
        ("talks-and-dies", "failed", "ended with code 7: the last words"),
        ("raises", "failed", "ZeroDivisionError: by nothing"),
        ("gives-up", "failed", "it did not converge"),
        ("nan", "invalid", "NaN or infinite at 1 vertices, the first being 7"),
        ("short", "invalid", r"uv is complex128 \(330,\); required is complex128 \(331,\)"),
        ("real", "invalid", "uv is float64"),
        ("nothing", "invalid", "returned a NoneType, not a Parameterization"),
        ("mirrored", "invalid", "reverses the surface's orientation"),
        ("off-circle", "invalid", "off the unit circle by up to 0.001"),
        ("folded", "invalid", "triangles are folded"),
        ("writes", "invalid", "changed the mesh"),
        ("wound-twice", "invalid", "goes around the circle twice, counter-clockwise; it must"),
        ("raises-real-time-signal", "failed", "ended by signal 37"),
        ("exits-politely", "failed", "SystemExit: 0"),
    ],
)
def test_every_fault_is_a_status_with_its_cause(name, status, cause, request):
    if name not in ("segfaults", "exits", "folded"):  # which end an interpreter of their own
        request.getfixturevalue("one_server")
    (task,) = tasks_of(name)
    record, uv = map_once(task)
    assert record.outcome.status == status
    assert re.search(cause, record.outcome.cause), record.outcome.cause
    if name in ("raises", "exits"):
        assert record.outcome.traceback
    assert record.outcome.faults
    kept = ("mirrored", "off-circle", "folded", "writes", "wound-twice")
    assert (uv is None) == (name not in kept)


@pytest.mark.usefixtures("one_server")
def test_a_large_surface_that_memory_cannot_take_is_not_tried(monkeypatch):
    monkeypatch.setattr("cembench.running.timing.expected_bytes", lambda *_: 2.0 * MEMORY)
    (task,) = tasks_of("good")
    record, uv = map_once(task, Options(memory_bytes=MEMORY))
    assert (record.outcome.status, uv) == ("out_of_memory", None)
    assert "need about 1,000 MiB by estimate, the limit is 500 MiB" in record.outcome.cause
    assert "the limit is" in record.outcome.cause
    assert map_once(task, Options(memory_bytes=3 * MEMORY))[0].outcome.status == "ok"


def test_what_is_short_of_memory_beside_others_is_checked_alone(monkeypatch, tmp_path):
    monkeypatch.setattr("cembench.running.timing.expected_bytes", lambda *_: 0.75 * MEMORY)
    options = Options(memory_bytes=MEMORY, jobs=2)
    records = run_tasks(tasks_of("good", "harmonic-circle"), Store(tmp_path), options)
    assert [record.outcome.status for record in records] == ["ok", "ok"]


def test_what_does_not_end_is_ended(tmp_path):
    options = Options(timeout=1, memory_bytes=MEMORY)
    for record in run_tasks(tasks_of("sleeps", "spins"), Store(tmp_path), options):
        assert record.outcome.status == "timeout"
        assert record.outcome.cause == "not finished after 1 s"
        assert record.outcome.median_seconds is None


def test_a_run_over_the_unruly_measures_the_good(tmp_path):
    expected = {
        "hoards": ("out_of_memory", "the limit is 500 MiB"),
        "hoards-in-a-child": ("out_of_memory", "the limit is 500 MiB"),
        "talks": ("ok", None),
        "forks": ("ok", None),
        "detaches": ("ok", None),
        "detaches-twice": ("ok", None),
        "daemonises": ("ok", None),
        "by-chance": ("ok", None),
        "fails-later": ("failed", "in round 1 of 1: ZeroDivisionError: by habit"),
        "good": ("ok", None),
        "harmonic-circle": ("ok", None),
    }
    # A process that is left behind may still be starting beside the next calls. Those of all calls
    # of a process together may take more than the limit for the others.
    left = ("forks", "detaches", "detaches-twice", "daemonises")
    others = [name for name in expected if name not in left]
    options = Options(memory_bytes=MEMORY)
    records = run_tasks(tasks_of(*others), Store(tmp_path / "others"), options)
    records += run_tasks(tasks_of(*left), Store(tmp_path / "left"), Options())
    outcomes = {record.cell.algorithm: record.outcome for record in records}
    assert {outcomes[name].status for name in left} <= {"ok", "not_comparable"}
    assert {name: o.status for name, o in outcomes.items() if name not in left} == {
        name: status for name, (status, _) in expected.items() if name not in left
    }
    for name, (status, cause) in expected.items():
        if name in left:
            continue
        assert cause is None or cause in outcomes[name].cause
        assert (outcomes[name].median_seconds is not None) == (status == "ok")
    assert MEMORY < outcomes["hoards"].peak_memory_bytes < 4 * MEMORY
    for name in left:
        assert not psutil.pid_exists(outcomes[name].extras["child"]) or (
            psutil.Process(outcomes[name].extras["child"]).status() == psutil.STATUS_ZOMBIE
        )
        assert outcomes[name].notes[0].kind is NoticeKind.PROCESSES_LEFT
    (note,) = outcomes["by-chance"].notes
    assert note.kind is NoticeKind.NOT_DETERMINISTIC
    assert note.text.endswith("different maps in rounds 1")
    assert outcomes["good"].notes == ()


def test_what_a_process_does_to_its_answer_or_to_the_others_fails_it_alone(tmp_path):
    expected = {
        "removes-scratch": ("failed", "the folder for its answer no longer exists"),
        "replaces-scratch": ("failed", "the folder for its answer no longer exists"),
        "answers-itself": ("failed", "an answer that cannot be read: Input should be 'ok'"),
        "answers-at-length": ("failed", "cannot be read: it takes 33,554,432 bytes"),
        "spoils-meshes": ("ok", None),
        "moves-away": ("ok", None),
        "good": ("ok", None),
    }
    store = Store(tmp_path)
    records = run_tasks(tasks_of(*expected), store)
    outcomes = {record.cell.algorithm: record.outcome for record in records}
    for name, (status, cause) in expected.items():
        assert outcomes[name].status == status, (name, outcomes[name].cause)
        assert cause is None or cause in outcomes[name].cause
    assert run_tasks(tasks_of(*expected), store) == records


@pytest.mark.parametrize(
    ("name", "kinds", "cause"),
    [
        ("zeros-later", (FaultKind.OTHER_MAP, FaultKind.OFF_CIRCLE), "off the unit circle by up"),
        ("worse-later", (FaultKind.OTHER_MAP, FaultKind.OTHER_ENERGY), "E_C over the area is"),
    ],
)
def test_a_timed_call_that_returns_a_worse_map_makes_the_cell_invalid(tmp_path, name, kinds, cause):
    (record,) = run_tasks(tasks_of(name), Store(tmp_path))
    outcome = record.outcome
    assert (outcome.status, outcome.rounds) == ("invalid", ())
    assert outcome.cause.startswith("in round 1 of 1: the second call ")
    assert "returned a different map from the check" in outcome.cause
    assert cause in outcome.cause
    assert tuple(fault.kind for fault in outcome.faults)[:2] == kinds


def test_a_good_one_is_measured_and_its_map_is_the_bare_call_s(tmp_path):
    (task,) = tasks_of("good", faces=6000, repeats=2)
    store = Store(tmp_path)
    (record,) = run_tasks([task], store)
    outcome = record.outcome
    assert (outcome.status, outcome.cause) == ("ok", None)
    assert all(r.calls for r in outcome.rounds)
    assert len(outcome.rounds) == 2
    assert outcome.median_seconds == min(outcome.seconds)
    assert sum(outcome.phases.values()) == pytest.approx(outcome.median_seconds, rel=0.02)
    assert outcome.extras == {"said": 1}
    assert outcome.peak_memory_bytes > 2**24
    assert 0 <= outcome.memory_increase_bytes < outcome.peak_memory_bytes
    # To rounding: where arrays lie in memory decides the last bit with some builds of BLAS.
    bare = task.algorithm.function(task.mesh).uv
    np.testing.assert_allclose(store.uv(task.cell), bare, rtol=0, atol=1e-14)


@pytest.mark.skipif(not can_fork(1), reason="processes cannot be forked here")
def test_the_memory_of_a_call_means_the_same_in_forked_and_started_processes(tmp_path):
    (task,) = tasks_of("good", faces=20_000)
    by_name = {}
    for forks in (True, False):
        with closing(CellTimer(tmp_path / str(forks), Options(), forks=forks)) as timer:
            by_name[forks], _ = timer.check(task)
    assert by_name[True].uv_hash == by_name[False].uv_hash
    increases = [by_name[forks].memory_increase_bytes for forks in (True, False)]
    assert abs(increases[0] - increases[1]) < 4 * 2**20, increases
    assert min(increases) > 8 * (3 * task.mesh.n + 2 * task.mesh.n), "the call's arrays at least"


def test_what_is_in_the_store_is_not_measured_again(tmp_path):
    class Noting(Watcher):
        def __init__(self):
            self.steps, self.kept = [], []

        def starts(self, task, step):
            self.steps.append((task.cell.algorithm, str(step)))

        def finished(self, task, record, *, kept):
            self.kept.append(kept)

    def run(tasks, **options):
        noting = Noting()
        return run_tasks(tasks, store, Options(**options), noting), noting

    store = Store(tmp_path / "run")
    tasks = tasks_of("good", "gives-up")
    first, noted = run(tasks)
    assert noted.steps == [("good", "check"), ("gives-up", "check"), ("good", "round 1 of 1")]
    assert noted.kept == [False, False]
    again, noted = run(tasks)
    assert (noted.steps, noted.kept, again) == ([], [True, True], first)
    _, noted = run(tasks, rerun_failed=True)
    assert noted.steps == [("gives-up", "check")]
    fresh, noted = run(tasks[:1], fresh=True)
    assert fresh[0].outcome.rounds[0].sitting != first[0].outcome.rounds[0].sitting
    assert len(noted.steps) == 2
    _, noted = run(tasks_of("good", solves="backslash"))
    assert noted.kept == [False]
    assert len(store.records()) == 3


def test_a_full_scratch_folder_is_an_error_that_says_so(tmp_path):
    (task,) = tasks_of("good", faces=2000)
    with (
        files_of_at_most(2**13),
        pytest.raises(OSError, match="File too large") as caught,
        closing(CellTimer(tmp_path, Options())) as timer,
    ):
        timer.check(task)
    assert caught.value.filename.endswith("-V.npy")


@pytest.mark.parametrize("change", [lambda text: text[:200], lambda text: text.replace("ok", "no")])
def test_a_fresh_run_replaces_damaged_records(tmp_path, change):
    store, (task,) = Store(tmp_path / "run"), tasks_of("good")
    run_tasks([task], store)
    file = store.record_file(task.cell)
    file.write_text(change(file.read_text()))
    with pytest.raises(RecordError, match="Delete it and run again"):
        run_tasks([task], store)
    (record,) = run_tasks([task], store, Options(fresh=True))
    assert run_tasks([task], store) == store.records() == [record]


def test_rounds_go_over_all_cells_in_turn(tmp_path):
    steps = []

    class Noting(Watcher):
        def starts(self, task, step):
            steps.append(str(step))

    run_tasks(tasks_of("good", "by-chance", repeats=2), Store(tmp_path), None, Noting())
    assert steps == ["check"] * 2 + ["round 1 of 2"] * 2 + ["round 2 of 2"] * 2


def _cells_of_three_surfaces():
    registry = load_registry([FAULTY])
    chosen = [registry.algorithm(name) for name in ("good", "nan", "raises")]
    disks = {faces: flat_disk(faces) for faces in (150, 600, 2400)}
    surfaces = [
        DiskMesh.from_arrays(disk.V, disk.F, name=f"disk-{faces}") for faces, disk in disks.items()
    ]
    tasks = plan_cells(chosen, surfaces, {}, MeasurementSettings(repeats=1), [FAULTY])
    assert len({task.cell.mesh_hash for task in tasks}) == 3
    return [CellState(task, samples=None) for task in tasks]


def test_the_order_within_a_round_is_random_and_set_by_the_seed():
    cells = _cells_of_three_surfaces()
    first, again, next_round, other = (
        [state.label for state in in_random_order(cells, seed, number)]
        for seed, number in ((0, 0), (0, 0), (0, 1), (1, 0))
    )
    assert sorted(first) == sorted(state.label for state in cells)
    assert first == again
    assert first != next_round
    assert first != other


def test_the_cells_of_a_surface_are_measured_one_after_the_other_in_any_order():
    cells = _cells_of_three_surfaces()
    rounds = [in_random_order(cells, 0, number) for number in range(400)]
    for order in rounds:
        surfaces = [state.task.cell.mesh_hash for state in order]
        assert len(list(groupby(surfaces))) == 3
    places = Counter((state.label, place) for order in rounds for place, state in enumerate(order))
    assert len(places) == 9 * 9  # every cell was at every place, and each about as often
    assert min(places.values()) > 400 / 9 / 2


def test_samples_of_a_killed_run_are_gone_on_with(tmp_path):
    class KilledError(Exception):
        pass

    class Killing(Watcher):
        def starts(self, task, step):
            if step.round == 2:
                raise KilledError

    store = Store(tmp_path)
    tasks = tasks_of("good", repeats=2)
    with pytest.raises(KilledError):
        run_tasks(tasks, store, None, Killing())
    samples = store.samples(tasks[0].cell, describe_environment()["id"])
    (kept,) = samples.rounds().values()
    assert not store.finished()
    (record,) = run_tasks(tasks, store)
    assert record.outcome.rounds[0] == kept
    assert record.outcome.rounds[1].sitting != kept.sitting
    assert not list((tmp_path / "samples").iterdir())


def test_an_edited_plugin_is_a_new_cell(tmp_path):
    source = Path(FAULTY).read_text(encoding="utf-8")
    keys = []
    for text in (source, source + "\n# edited\n", source):
        (tmp_path / "plugin.py").write_text(text)
        plugin = str(tmp_path / "plugin.py")
        chosen = load_registry([plugin]).algorithm("good")
        (task,) = plan_cells([chosen], [flat_disk(600)], {}, MeasurementSettings(), [plugin])
        keys.append(task.cell.key)
    assert keys[0] == keys[2] != keys[1]


def test_threads_are_pinned_for_the_cell_s_process():
    pinned = for_measuring(3)
    assert {pinned[k] for k in ("OMP_NUM_THREADS", "MKL_NUM_THREADS")} == {"3"}
    assert pinned["OPENBLAS_NUM_THREADS"] == "1"  # sums depend on the number


@pytest.mark.parametrize(
    "own", ["", "glibc.malloc.arena_max=1", "glibc.malloc.hugetlb=0:glibc.malloc.arena_max=1"]
)
def test_timed_processes_keep_their_memory_unless_the_user_decides(monkeypatch, own):
    monkeypatch.setenv("GLIBC_TUNABLES", own)
    settings = for_measuring(1)["GLIBC_TUNABLES"]
    by_name = dict(one.split("=") for one in settings.split(":"))
    assert by_name == ALLOCATOR | dict(one.split("=") for one in own.split(":") if one)
    assert len(by_name) == settings.count("=")
    assert describe_environment()["allocator"]["settings"] == settings


def test_the_environment_says_what_a_figure_depends_on():
    environment = describe_environment()
    assert environment["libraries"]["cvxopt"]
    assert environment["memory_bytes"] > 0
    assert environment == describe_environment()


def test_a_renamed_mesh_is_not_measured_again(tmp_path):
    def task_called(name):
        chosen = load_registry([FAULTY]).algorithm("good")
        mesh = dataclasses.replace(flat_disk(600), name=name)
        return plan_cells([chosen], [mesh], {}, MeasurementSettings(repeats=1), [FAULTY])[0]

    def meshes():
        return [record.cell.mesh for record in store.records()]

    store = Store(tmp_path)
    old, new = task_called("old"), task_called("new")
    (first,) = run_tasks([old], store)
    (kept,) = run_tasks([new], store)
    assert kept.outcome == first.outcome
    assert kept.cell == new.cell
    assert meshes() == ["new"]
    assert store.uv(new.cell) is not None
    assert not list((tmp_path / "maps").glob("old--*"))
    both = run_tasks([old, new], store)
    assert [r.outcome for r in both] == [first.outcome] * 2
    assert meshes() == ["new", "old"]


def test_a_run_keeps_its_surfaces_also_those_of_cells_from_before(tmp_path):
    store = Store(tmp_path)
    (task,) = tasks_of("harmonic-circle")
    run_tasks([task], store)
    assert store.mesh(task.cell).hash == task.mesh.hash
    (kept,) = (tmp_path / "meshes").iterdir()
    kept.unlink()
    run_tasks([task], store)
    assert store.mesh(task.cell).name == task.mesh.name
