from pathlib import Path

import numpy as np
import pytest

from cembench.registry import load_registry
from cembench.running.environment import describe_environment, with_threads
from cembench.running.local import run_task, run_tasks
from cembench.running.plan import How, plan_cells
from cembench.store import Store
from meshes_gen.flat_disk import flat_disk

FAULTY = str(Path(__file__).with_name("faulty.py"))


@pytest.fixture(scope="module")
def environment():
    return describe_environment()


def task_of(name, **how):
    chosen = load_registry([FAULTY]).algorithm(name)
    (task,) = plan_cells([chosen], [flat_disk(600)], {}, How(repeats=1, **how), [FAULTY])
    return task


@pytest.mark.parametrize(
    ("name", "status", "cause"),
    [
        ("sleeps", "timeout", "not finished after 4 s"),
        ("segfaults", "failed", "signal SIGSEGV"),
        ("exits", "failed", "ended with code 7: the last words"),
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
    ],
)
def test_every_fault_is_a_status_with_its_cause(name, status, cause, environment):
    import re

    record, uv = run_task(task_of(name), environment, timeout=4 if name == "sleeps" else 60)
    assert record.outcome.status == status
    assert re.search(cause, record.outcome.cause), record.outcome.cause
    if name in ("raises", "exits"):
        assert record.outcome.traceback
    assert (uv is None) == (name not in ("mirrored", "off-circle", "folded", "writes"))


def test_a_good_one_is_measured_and_its_map_is_the_bare_call_s(environment):
    task = task_of("good")
    record, uv = run_task(task, environment, timeout=60)
    outcome = record.outcome
    assert (outcome.status, outcome.cause) == ("ok", None)
    assert sum(outcome.phases.values()) == pytest.approx(outcome.median_seconds, rel=0.02)
    assert outcome.extras == {"said": 1}
    assert outcome.peak_memory_bytes > 2**24
    np.testing.assert_array_equal(uv, task.algorithm.function(task.mesh).uv)


def test_what_is_in_the_store_is_not_measured_again(tmp_path):
    store = Store(tmp_path / "run")
    tasks = [task_of("good"), task_of("gives-up")]
    first = list(run_tasks(tasks, store))
    assert [resumed for *_, resumed in first] == [False, False]
    again = list(run_tasks(tasks, store))
    assert [resumed for *_, resumed in again] == [True, True]
    assert [r for _, r, *_ in again] == [r for _, r, *_ in first]
    np.testing.assert_array_equal(again[0][2], first[0][2])
    fresh = list(run_tasks(tasks[:1], store, fresh=True))
    assert fresh[0][1].outcome.seconds != first[0][1].outcome.seconds
    backslash = list(run_tasks([task_of("good", solves="backslash")], store))
    assert [resumed for *_, resumed in backslash] == [False]
    assert len(store.records()) == 3


def test_an_edited_plugin_is_a_new_cell(tmp_path):
    source = Path(FAULTY).read_text()
    keys = []
    for text in (source, source + "\n# edited\n", source):
        (tmp_path / "plugin.py").write_text(text)
        plugin = str(tmp_path / "plugin.py")
        chosen = load_registry([plugin]).algorithm("good")
        (task,) = plan_cells([chosen], [flat_disk(600)], {}, How(), [plugin])
        keys.append(task.cell.key)
    assert keys[0] == keys[2] != keys[1]


def test_threads_are_pinned_for_the_cell_s_process():
    pinned = with_threads(3)
    assert {pinned[k] for k in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")} == {"3"}


def test_the_environment_says_what_a_figure_depends_on(environment):
    assert environment["libraries"]["cvxopt"]
    assert environment["memory_bytes"] > 0
    assert environment == describe_environment()
