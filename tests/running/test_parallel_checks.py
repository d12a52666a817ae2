"""Checks in parallel: the same outcomes as one after another, and an interrupt ends them all."""

import threading
from contextlib import contextmanager

import psutil
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.parallel_checks import check_in_parallel
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.schedule import CellState
from cembench.running.watcher import Watcher

SLEEPER = """
import time

from cembench import DiskMesh, Parameterization, algorithm


@algorithm("sleeper", title="Sleeper", target="disk", source="none")
def sleeper(mesh: DiskMesh) -> Parameterization:
    time.sleep(60)
"""


class Checker:
    """Answers when it is told to; counts how many are at work."""

    at_work, most = 0, 0
    lock = threading.Lock()

    def __init__(self, barrier):
        self.barrier, self.stopped = barrier, threading.Event()

    def check(self, task):
        with Checker.lock:
            Checker.at_work += 1
            Checker.most = max(Checker.most, Checker.at_work)
        self.barrier.wait(20)
        with Checker.lock:
            Checker.at_work -= 1
        return f"outcome of {task}", None

    def stop(self):
        self.stopped.set()


@contextmanager
def unwatched(state):
    yield


def states(tasks):
    return [CellState(task, samples=None) for task in tasks]


def test_as_many_checks_run_at_a_time_as_there_are_checkers():
    barrier = threading.Barrier(2)  # no check ends unless another one runs beside it
    checkers = [Checker(barrier) for _ in range(2)]
    results = list(check_in_parallel(states("abcd"), checkers, unwatched))
    assert sorted(state.task for state, _ in results) == ["a", "b", "c", "d"]
    assert all(outcome == (f"outcome of {state.task}", None) for state, outcome in results)
    assert Checker.most == 2
    assert not any(checker.stopped.is_set() for checker in checkers)


def test_a_fault_of_a_checker_is_raised_and_the_others_are_stopped():
    class Faulty(Checker):
        def check(self, task):
            if task == "b":
                raise OSError("no room")
            self.stopped.wait(20)
            return "stopped", None

    checkers = [Faulty(None), Faulty(None)]
    with pytest.raises(OSError, match="no room"):
        list(check_in_parallel(states("abc"), checkers, unwatched))
    assert all(checker.stopped.is_set() for checker in checkers)


@pytest.mark.usefixtures("kept_servers")
def test_a_run_with_two_jobs_has_the_records_of_one_with_one(tmp_path):
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in ("lscm", "harmonic-circle")]
    meshes = [flat_disk(60), spherical_cap(96)]
    tasks = plan_cells(chosen, meshes, {}, MeasurementSettings(repeats=1))
    both = [
        run_tasks(tasks, Store(tmp_path / f"run-{jobs}"), Options(jobs=jobs)) for jobs in (1, 2)
    ]
    for one, other in zip(*both, strict=True):
        assert one.cell == other.cell
        assert (one.outcome.status, other.outcome.status) == ("ok", "ok")
        assert one.outcome.uv_hash == other.outcome.uv_hash
        assert one.outcome.metrics == other.outcome.metrics
        assert len(other.outcome.rounds) == 1


def test_an_interrupt_ends_every_check_at_once(tmp_path):
    plugin = tmp_path / "sleeper.py"
    plugin.write_text(SLEEPER)
    registry = load_registry([str(plugin)])
    meshes = [flat_disk(faces) for faces in (60, 80)]
    meshes = [mesh.renamed(f"flat-{k}") for k, mesh in enumerate(meshes)]
    how = MeasurementSettings(repeats=1)
    tasks = plan_cells([registry.algorithm("sleeper")], meshes, {}, how, [str(plugin)])

    class Interrupting(Watcher):
        started = 0

        def starts(self, task, step):
            self.started += 1
            if self.started == 2:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_tasks(tasks, Store(tmp_path / "run"), Options(jobs=2), Interrupting())
    left = [
        one
        for one in psutil.Process().children(recursive=True)
        if one.status() != psutil.STATUS_ZOMBIE and "worker" in " ".join(one.cmdline())
    ]
    assert left == []
    assert Store(tmp_path / "run").finished() == []
