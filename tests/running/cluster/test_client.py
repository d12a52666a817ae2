"""Two workers on this machine measure what one process does."""

from dataclasses import replace
from pathlib import Path
from time import monotonic
from types import SimpleNamespace

import pytest
from cembench.surfaces.cone import cone
from cembench.surfaces.flat_disk import flat_disk

from cembench.api.benchmark import benchmark
from cembench.core.errors import ClusterError
from cembench.registry import load_registry
from cembench.results.records import FaultKind
from cembench.results.store import Store
from cembench.running import recorder
from cembench.running.cluster.state import read_state
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.watcher import Watcher
from tests.running.test_local import FAULTY

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
from cembench.running.cluster import client as module
from cembench.running.cluster.client import run_on_cluster

DEADLY = str(Path(__file__).with_name("deadly.py"))
SURFACES = (flat_disk(200), cone(200).renamed("sent"))


class Listener(Watcher):
    def __init__(self):
        self.told, self.finishes, self.steps, self.expected = [], [], [], 0

    def begins(self, processes):
        self.expected += processes

    def shows(self, words):
        self.told.append(words)

    def ends(self, task, step, seconds):
        self.steps.append((task.cell.label, str(step)))

    def finished(self, task, record, *, kept):
        self.finishes.append((task.cell.label, kept))


def tasks_of(*names, surfaces=SURFACES, plugin=FAULTY):
    registry = load_registry([plugin])
    chosen = [registry.algorithm(name) for name in names]
    settings = MeasurementSettings(repeats=1)
    return plan_cells(chosen, surfaces, {}, settings, [plugin])


def test_two_workers_give_the_same_maps_and_statuses_as_one_process(client, tmp_path):
    tasks = tasks_of("good", "nan")
    records = run_tasks(tasks, Store(tmp_path / "here"))
    store, heard = Store(tmp_path / "there"), Listener()
    there = run_on_cluster(tasks, store, client, watcher=heard)
    assert [r.outcome.status for r in there] == ["ok", "invalid"] * 2
    for a, b in zip(there, records, strict=True):
        assert a.cell == b.cell
        assert a.outcome.status == b.outcome.status
        assert a.outcome.uv_hash == b.outcome.uv_hash
        ours, theirs = store.uv(a.cell), Store(tmp_path / "here").uv(b.cell)
        assert (ours is None and theirs is None) or (ours == theirs).all()
    for surface in SURFACES:  # ratios stay in one sitting
        of_it = [r for r in there if r.cell.mesh == surface.name]
        assert len({round_.sitting for r in of_it for round_ in r.outcome.rounds}) == 1
    assert {e["machine"] for e in store.environments().values()} != {None}
    assert heard.expected == 2 * len(tasks)
    assert len(heard.finishes) == len(tasks)
    assert len(set(heard.steps)) == 4 + 2  # a check each, a round of those that are ok
    state = read_state(tmp_path / "there")
    assert (state.units, state.done, sum(m.units for m in state.machines)) == (2, 2, 2)

    again = Listener()
    assert run_on_cluster(tasks, store, client, watcher=again) == there
    assert again.finishes == [(task.cell.label, True) for task in tasks]
    assert again.steps == []


def test_a_unit_that_ends_two_workers_is_recorded_and_the_rest_measured(client, tmp_path):
    deadly = tasks_of("ends-the-worker", surfaces=SURFACES[:1], plugin=DEADLY)
    tasks = [*deadly, *tasks_of("good", surfaces=SURFACES[1:])]
    store, heard = Store(tmp_path), Listener()
    first, good = run_on_cluster(tasks, store, client, watcher=heard)
    assert first.outcome.status == "failed"
    (fault,) = first.outcome.faults
    assert fault.kind is FaultKind.WORKERS_LOST
    assert "ended 2 workers" in fault.detail
    assert "check of ends-the-worker" in fault.detail
    assert good.outcome.status == "ok"
    assert any("flat-disk" in words and "again" in words for words in heard.told)
    assert {r.cell.algorithm for r in store.records()} == {"ends-the-worker", "good"}


def test_an_interrupted_run_frees_its_workers_at_once(client, tmp_path):
    class Interrupting(Watcher):
        def starts(self, task, step):
            raise KeyboardInterrupt

    asleep = tasks_of("sleeps", surfaces=SURFACES[:1])
    with pytest.raises(KeyboardInterrupt):
        run_on_cluster(asleep, Store(tmp_path / "asleep"), client, watcher=Interrupting())
    # It sleeps for ten minutes, and so long the lock of the machine would be held.
    good = tasks_of("good", surfaces=SURFACES[:1])
    began = monotonic()
    (record,) = run_on_cluster(good, Store(tmp_path / "good"), client)
    assert record.outcome.status == "ok"
    assert monotonic() - began < 300
    assert Store(tmp_path / "asleep").finished() == []


def test_machines_with_other_software_can_be_refused(client, tmp_path, monkeypatch):
    true = recorder.describe_environment()
    monkeypatch.setattr(recorder, "describe_environment", lambda: true | {"python": "2.7"})
    heard = Listener()
    with pytest.raises(ClusterError, match="no worker has the software"):
        run_on_cluster(
            tasks_of("good"), Store(tmp_path), client, watcher=heard, same_environment=True
        )
    assert [words for words in heard.told if "measures nothing: its software" in words]
    assert Store(tmp_path).finished() == []


def test_a_worker_without_cembench_ends_the_run_and_says_so(client, tmp_path, monkeypatch):
    def fails():
        raise ModuleNotFoundError("No module named 'cembench'")

    monkeypatch.setattr(module, "describe_environment", fails)
    with pytest.raises(ClusterError, match=r"cannot measure: No module named .*\. Install"):
        run_on_cluster(tasks_of("good"), Store(tmp_path), client)


def test_other_software_is_named(client, tmp_path, monkeypatch):
    true = recorder.describe_environment()
    monkeypatch.setattr(recorder, "describe_environment", lambda: true | {"python": "2.7"})
    heard = Listener()
    (record,) = run_on_cluster(
        tasks_of("good", surfaces=SURFACES[:1]), Store(tmp_path), client, watcher=heard
    )
    assert record.outcome.status == "ok"
    assert [words for words in heard.told if "other software: python: 2.7 / " in words]


def test_what_a_worker_cannot_measure_ends_the_run_and_says_where(client, tmp_path):
    tasks = tasks_of("good", surfaces=SURFACES[:1])
    other = tasks[0].cell.model_copy(update={"code_hash": "0" * 64})
    tasks = [replace(tasks[0], cell=other)]
    with pytest.raises(ClusterError, match=r"flat-disk cannot be measured on .*: good has other"):
        run_on_cluster(tasks, Store(tmp_path), client, Options())


def test_a_run_whose_own_workers_are_all_gone_ends_and_says_so(tmp_path, monkeypatch):
    from distributed import Client, LocalCluster

    monkeypatch.setattr(module, "LOCAL_PATIENCE", 0.5)
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as nobody,
        Client(nobody, set_as_default=False) as alone,
        pytest.raises(ClusterError, match="all workers of this machine are gone"),
    ):
        run_on_cluster(tasks_of("good", surfaces=SURFACES[:1]), Store(tmp_path), alone)


def test_a_worker_that_comes_back_to_its_address_takes_part_again(tmp_path):
    heard, addresses = [], ["tcp://here:1"]
    described = {"id": "one", "machine": "here"}
    client = SimpleNamespace(
        status="running",
        cluster=None,
        nthreads=lambda: dict.fromkeys(addresses, 1),
        run=lambda _, workers, **more: dict.fromkeys(workers, described),
    )
    watcher = SimpleNamespace(machines=heard.append)
    recorder = SimpleNamespace(environment=described, watcher=watcher, store=Store(tmp_path))
    run = module._ClusterRun(recorder, client, same_environment=False)
    for there in (["tcp://here:1"], [], ["tcp://here:1"]):
        addresses[:] = there
        run._look()
    assert heard == [["here"], [], ["here"]]


def test_the_python_function_takes_a_client(client, tmp_path):
    run = benchmark(["flat-disk"], ["harmonic-circle"], rounds=1, output=tmp_path, cluster=client)
    (record,) = run.records()
    assert record.outcome.status == "ok"
    assert read_state(tmp_path).done == 1
