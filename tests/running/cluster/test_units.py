"""What travels, and the machine that it travels to; no scheduler takes part."""

import json
import pickle
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.commands.cluster import hours, makespan, show_hours
from cembench.core.errors import ClusterError, ParameterError
from cembench.registry import load_registry
from cembench.results.machines import differences
from cembench.results.store import Store
from cembench.running.cluster import host
from cembench.running.cluster.connect import parse_cluster, quiet_variables
from cembench.running.cluster.state import ClusterState, MachineState, read_state, save_state
from cembench.running.cluster.units import pack
from cembench.running.environment import MACHINE_VARIABLE, describe_environment
from cembench.running.estimate import Estimate
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, comparable_groups, plan_cells
from tests.running.test_local import FAULTY, tasks_of

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
from cembench.running.cluster.worker import Forwarder, measure

NO_TOKEN = "0" * 32


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))


def two_surfaces(*policies):
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in ("harmonic-circle", "lscm")]
    meshes = [flat_disk(100).renamed("one"), flat_disk(200).renamed("two")]
    return [
        task
        for policy in policies
        for task in plan_cells(chosen, meshes, {}, MeasurementSettings(policy, repeats=1))
    ]


def test_a_unit_is_a_surface_under_a_policy_with_all_algorithms():
    groups = comparable_groups(two_surfaces("reuse", "backslash"))
    assert len(groups) == 4
    for group in groups:
        assert [task.cell.algorithm for task in group] == ["harmonic-circle", "lscm"]
        assert len({(task.cell.mesh, task.cell.solves) for task in group}) == 1


def test_a_unit_is_the_same_after_it_was_sent():
    one = pack(tasks_of("good"), NO_TOKEN, Options(timeout=5, seed=3))
    sent = pickle.loads(pickle.dumps(one))
    assert (sent.key, sent.cells, sent.options) == (one.key, one.cells, Options(timeout=5, seed=3))
    assert sent.mesh.hash == one.mesh.hash
    assert pack(tasks_of("good"), "1" * 32, Options(timeout=5, seed=3)).key != one.key


def test_a_plug_in_travels_with_all_files_that_its_code_is_known_by(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "beside.py").write_text("value = 1\n")
    plugin = tmp_path / "mine.py"
    plugin.write_text(
        "import sys\nfrom pathlib import Path\nsys.path.insert(0, str(Path(__file__).parent))\n"
        "import beside\n" + Path(FAULTY).read_text(encoding="utf-8")
    )
    registry = load_registry([str(plugin)])
    tasks = plan_cells(
        [registry.algorithm("good")],
        [flat_disk(100)],
        {},
        MeasurementSettings(repeats=1),
        [str(plugin), "json:loads"],
    )
    sent = pack(tasks, NO_TOKEN, Options()).plugins
    assert {name: set(files) for name, files in sent.items()} == {
        str(plugin): {"mine.py", "beside.py"},
        "json:loads": set(),
    }


@pytest.mark.parametrize(("machines", "seconds"), [(1, 12.0), (2, 6.0), (3, 5.0), (100, 5.0)])
def test_more_machines_take_less_until_the_longest_unit_is_all(machines, seconds):
    assert makespan([1.0, 2.0, 5.0, 4.0], machines) == seconds


def test_hours_name_what_limits_them():
    tasks = two_surfaces("reuse")
    cost = Estimate(1.0, 100.0, 1e6, "recorded", 100.0)
    seconds = hours(tasks, [cost, cost, replace(cost, seconds=700.0), cost], None)
    assert seconds["seconds"] == {1: 1000.0, 10: 800.0, 100: 800.0}
    assert (seconds["longest"], seconds["units"], seconds["useful"]) == ("two", 2, 2)
    held = hours(tasks, [None, None, cost, cost], None)
    assert (held["units"], held["seconds"][10]) == (1, 200.0)


def test_hours_are_told_in_eighty_columns_with_what_limits_them(capsys):
    cost = Estimate(1.0, 100.0, 1e6, "recorded", 100.0)
    costs = [cost, cost, replace(cost, seconds=700.0), cost]
    show_hours(hours(two_surfaces("reuse"), costs, None))
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 80
    assert "10 machines  about 13 min, as long as two takes" in told
    assert "The longest of 2 takes about 13 min: more than 2 machines gain nothing" in told
    show_hours(hours([], [], None))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    "text",
    ["", "local", "local:0", "local:x", "http://a:1", "tcp://a", "slurm", "slurm:cores=4",
     "slurm:partition=a,cores=none", "slurm:partition=a,cores=4,colour=red",
     "slurm:partition=a,cores=4,exclusive=perhaps"],
)  # fmt: skip
def test_a_place_that_cannot_be_read_is_refused_with_what_is_allowed(text):
    with pytest.raises(ParameterError, match=r"allowed|missing|whole number|yes or no"):
        parse_cluster(text)


def test_places_are_read():
    assert parse_cluster("local:4").workers == 4
    assert parse_cluster("tcp://host:8786").address == "tcp://host:8786"
    found = parse_cluster("slurm:partition=cpu,cores=16,machines=10").settings
    assert (found["partition"], found["machines"], found["exclusive"]) == ("cpu", "10", "yes")


def test_one_worker_of_a_machine_measures_at_a_time():
    order, waiting = [], threading.Event()

    def other():
        with host.machine_lock(waiting.set):
            order.append("second")

    with host.machine_lock(lambda: None):
        thread = threading.Thread(target=other)
        thread.start()
        assert waiting.wait(30)
        order.append("first")
    thread.join()
    assert order == ["first", "second"]


def test_a_unit_that_is_cancelled_does_not_wait_for_its_machine():
    def cancelled():
        raise ClusterError("cancelled")

    with (
        host.machine_lock(lambda: None),
        pytest.raises(ClusterError, match="cancelled"),
        host.machine_lock(cancelled),
    ):
        pass


def test_a_lock_that_cannot_be_opened_is_an_error_with_its_remedy():
    host.place().mkdir(parents=True)
    (host.place() / "locks").touch()
    with pytest.raises(ClusterError, match="Set CEMBENCH_CACHE"), host.machine_lock(lambda: None):
        pass


def test_what_nobody_came_back_for_is_deleted():
    (host.unit_folder("a") / "run").mkdir(parents=True)
    host.clear_old()
    assert host.unit_folder("a").exists()
    host.clear_old(days=-1)
    assert not host.unit_folder("a").exists()


def test_a_unit_comes_to_the_same_as_on_one_machine(tmp_path):
    tasks = tasks_of("good", "nan")
    unit = pack(tasks, NO_TOKEN, Options())
    collected = []
    store = Store(tmp_path / "there")
    there = measure(unit, store, Forwarder(collected.append, lambda: True))
    assert [store.find(task.cell) for task in tasks] == there
    records = run_tasks(tasks, Store(tmp_path / "here"))
    for a, b in zip(there, records, strict=True):
        assert (a.cell, a.sources, a.outcome.status) == (b.cell, b.sources, b.outcome.status)
        assert a.outcome.uv_hash == b.outcome.uv_hash
    assert {event["what"] for event in collected} == {"starts", "ends"}
    assert json.loads(json.dumps(collected)) == collected


def test_other_code_under_the_same_name_is_refused(tmp_path):
    tasks = [
        replace(task, cell=task.cell.model_copy(update={"code_hash": "0" * 64}))
        for task in tasks_of("good")
    ]
    unit = pack(tasks, NO_TOKEN, Options())
    with pytest.raises(ClusterError, match=r"good has other code on .* faulty.py"):
        measure(unit, Store(tmp_path), Forwarder(lambda event: None, lambda: True))


def test_a_surface_that_arrives_damaged_is_refused(tmp_path):
    (task,) = tasks_of("good")
    unit = pack([task], NO_TOKEN, Options())
    mesh = type(task.mesh).trusted(task.mesh.V + 1, task.mesh.F, task.mesh.name)
    with pytest.raises(ClusterError, match="arrived damaged"):
        measure(
            replace(unit, mesh=mesh), Store(tmp_path), Forwarder(lambda event: None, lambda: True)
        )


def test_differences_of_software_name_library_and_versions():
    ours = {"cembench": "1", "libraries": {"numpy": "2.1", "scipy": "1.15"}}
    theirs = {"cembench": "1", "libraries": {"numpy": "2.0", "scipy": "1.15"}, "cpu": "another"}
    assert differences(ours, theirs) == ["numpy: 2.1 / 2.0"]
    assert differences({"cembench": {}}, {"cembench": "1"}) == ["cembench: {} / 1"]
    assert differences({"libraries": {"numpy": "2"}}, {}) == ["numpy: 2 / None"]


def test_a_machine_may_be_named(monkeypatch):
    before = describe_environment()
    monkeypatch.setenv(MACHINE_VARIABLE, "node-17")
    now = describe_environment()
    assert now["machine"] == "node-17"
    assert now["id"] != before["id"]


def test_how_far_a_run_is_can_be_read_again(tmp_path):
    assert read_state(tmp_path) is None
    state = ClusterState(units=3, done=1, machines=[MachineState(machine="a", units=1, at="foot")])
    save_state(tmp_path, state)
    assert read_state(tmp_path) == state


def test_what_is_kept_of_a_unit_counts_under_another_share_of_the_budget():
    one = pack(tasks_of("good"), NO_TOKEN, Options(budget=5.0))
    other = pack(tasks_of("good"), NO_TOKEN, Options(budget=7.0))
    assert one.options != other.options
    assert one.key == other.key
    assert pack(tasks_of("nan"), NO_TOKEN, Options(budget=5.0)).key != one.key


def test_the_page_names_how_dask_is_kept_quiet():
    page = (Path(__file__).parents[3] / "docs" / "cluster.md").read_text()
    for name, value in quiet_variables().items():
        assert page.count(f"{name}={value}") == 1
