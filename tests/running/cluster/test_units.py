"""What travels, and the machine that it travels to; no scheduler takes part."""

import json
import os
import sys
import tempfile
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.commands.cluster import hours, show_hours
from cembench.core.errors import ClusterError, ParameterError
from cembench.registry import load_registry
from cembench.results.machines import differences, software_of
from cembench.results.store import Store
from cembench.running.cluster import host
from cembench.running.cluster.connect import parse_cluster, quiet_variables
from cembench.running.cluster.measure import measure
from cembench.running.cluster.state import ClusterState, MachineState, read_state, save_state
from cembench.running.cluster.units import Unit, grouped, makespan, parcel
from cembench.running.environment import MACHINE_VARIABLE, describe_environment
from cembench.running.estimate import Estimate
from cembench.running.local import Options, run_tasks
from cembench.running.plan import MeasurementSettings, plan_cells
from tests.running.test_local import FAULTY, tasks_of

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
    groups = grouped(two_surfaces("reuse", "backslash"))
    assert len(groups) == 4
    for group in groups:
        assert [task.cell.algorithm for task in group] == ["harmonic-circle", "lscm"]
        assert len({(task.cell.mesh, task.cell.solves) for task in group}) == 1


def test_a_unit_is_the_same_after_it_was_sent():
    one = parcel(tasks_of("good"), NO_TOKEN, Options(timeout=5, seed=3)).unit
    sent = Unit.model_validate_json(one.model_dump_json())
    assert sent == one
    assert sent.key == one.key
    assert sent.run_options() == Options(timeout=5, seed=3)
    assert parcel(tasks_of("good"), "1" * 32, Options(timeout=5, seed=3)).unit.key != one.key


def test_a_plug_in_travels_with_all_files_that_its_code_is_known_by(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "beside.py").write_text("value = 1\n")
    plugin = tmp_path / "mine.py"
    plugin.write_text(
        "import sys\nfrom pathlib import Path\nsys.path.insert(0, str(Path(__file__).parent))\n"
        "import beside\n" + Path(FAULTY).read_text()
    )
    registry = load_registry([str(plugin)])
    tasks = plan_cells(
        [registry.algorithm("good")],
        [flat_disk(100)],
        {},
        MeasurementSettings(repeats=1),
        [str(plugin), "json:loads"],
    )
    one = parcel(tasks, NO_TOKEN, Options())
    assert {name: set(files) for name, files in one.plugin_files.items()} == {
        str(plugin): {"mine.py", "beside.py"}
    }
    assert one.unit.plugins == (str(plugin), "json:loads")


@pytest.mark.parametrize(("machines", "seconds"), [(1, 12.0), (2, 6.0), (3, 5.0), (100, 5.0)])
def test_more_machines_take_less_until_the_longest_unit_is_all(machines, seconds):
    assert makespan([1.0, 2.0, 5.0, 4.0], machines) == seconds


def test_hours_name_what_limits_them():
    tasks = two_surfaces("reuse")
    cost = Estimate(1.0, 100.0, 1e6, "recorded", 100.0)
    found = hours(tasks, [cost, cost, replace(cost, seconds=700.0), cost], None)
    assert found["seconds"] == {1: 1000.0, 10: 800.0, 100: 800.0}
    assert (found["longest"], found["units"], found["useful"]) == ("two", 2, 2)
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


def test_a_machine_times_for_one_alone(tmp_path):
    path = tmp_path / "lock"
    order = []
    with host.Turn(path) as first, host.Turn(path) as second, host.Turn(path) as third:
        first.share()
        second.share()  # checks run side by side
        waiting = threading.Event()

        def times():
            third.alone(waiting.set)
            order.append("times")

        thread = threading.Thread(target=times)
        thread.start()
        waiting.wait()
        order.append("checked")
        first.__exit__()
        first.__enter__()
        second.__exit__()
        second.__enter__()
        thread.join()
        asked = threading.Event()

        def checks():
            asked.set()
            first.share()
            order.append("checks again")

        thread = threading.Thread(target=checks)
        thread.start()
        asked.wait()
        order.append("timed")
        third.__exit__()
        thread.join()
        third.__enter__()
    assert order == ["checked", "times", "timed", "checks again"]


def test_a_surface_is_kept_by_its_hash_and_a_damaged_one_is_not():
    mesh = flat_disk(100)
    assert host.kept_surface(mesh.hash) is None
    host.keep_surface(mesh.hash, (mesh.V, mesh.F))
    V, F = host.kept_surface(mesh.hash)
    assert (V == mesh.V).all()
    assert (F == mesh.F).all()
    (file,) = (host.place() / "surfaces").iterdir()
    file.write_bytes(b"no archive")
    assert host.kept_surface(mesh.hash) is None
    assert not file.exists()


def test_what_nobody_came_back_for_is_deleted():
    mesh = flat_disk(100)
    host.keep_surface(mesh.hash, (mesh.V, mesh.F))
    (host.unit_folder("a") / "run").mkdir(parents=True)
    host.clear_old()
    assert host.kept_surface(mesh.hash) is not None
    host.clear_old(days=-1)
    assert host.kept_surface(mesh.hash) is None
    assert not host.unit_folder("a").exists()


def test_a_unit_comes_to_the_same_as_on_one_machine(tmp_path):
    tasks = tasks_of("good", "nan")
    unit = parcel(tasks, NO_TOKEN, Options()).unit
    host.keep_surface(unit.mesh_hash, (tasks[0].mesh.V, tasks[0].mesh.F))
    told = []
    there = measure(unit, tmp_path / "there", told.append)
    here = run_tasks(tasks, Store(tmp_path / "here"))
    for a, b in zip(there, here, strict=True):
        assert (a.cell, a.sources, a.outcome.status) == (b.cell, b.sources, b.outcome.status)
        assert a.outcome.uv_hash == b.outcome.uv_hash
    assert told[0]["what"] == "began"
    assert {event["what"] for event in told[1:]} == {"starts", "ends"}
    assert json.loads(json.dumps(told)) == told


def test_other_code_under_the_same_name_is_refused(tmp_path):
    tasks = [
        replace(task, cell=task.cell.model_copy(update={"code_hash": "0" * 64}))
        for task in tasks_of("good")
    ]
    unit = parcel(tasks, NO_TOKEN, Options()).unit
    host.keep_surface(unit.mesh_hash, (tasks[0].mesh.V, tasks[0].mesh.F))
    with pytest.raises(ClusterError, match=r"good is other code on .* faulty.py"):
        measure(unit, tmp_path, lambda event: None)


def test_a_surface_that_is_gone_is_told(tmp_path):
    with pytest.raises(ClusterError, match="not on this machine any more"):
        measure(parcel(tasks_of("good"), NO_TOKEN, Options()).unit, tmp_path, lambda event: None)


def test_other_software_is_refused_where_it_must_not_be(tmp_path):
    software = software_of(describe_environment()) | {"python": "2.7"}
    unit = parcel(tasks_of("good"), NO_TOKEN, Options(), software=software).unit
    told = []
    assert measure(unit, tmp_path, told.append) is None
    assert told[0]["what"] == "refused"
    assert told[0]["why"].startswith("python: 2.7 / ")


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
    one = parcel(tasks_of("good"), NO_TOKEN, Options(budget=5.0)).unit
    other = parcel(tasks_of("good"), NO_TOKEN, Options(budget=7.0)).unit
    assert one.options != other.options
    assert one.key == other.key
    assert parcel(tasks_of("nan"), NO_TOKEN, Options(budget=5.0)).unit.key != one.key


def test_whose_turn_it_is_hangs_on_one_file_of_the_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    assert host.Turn().path == Path(f"/tmp/cembench-{os.geteuid()}/machine.lock")
    path = tmp_path / "lock"
    with host.Turn(path) as one:
        one.alone()
        with host.Turn(path) as other:
            assert not other._lock(alone=True, at_once=True)
    (tmp_path / "link").symlink_to(path)
    os.mkfifo(tmp_path / "fifo")
    for cannot in (tmp_path / "none" / "lock", tmp_path / "link", tmp_path / "fifo"):
        with (
            pytest.raises(ClusterError, match="by which the workers of a machine take turns"),
            host.Turn(cannot),
        ):
            pass


@pytest.mark.parametrize("taken", ["link", "file", "open to all", "another user's"])
def test_whoever_takes_the_name_of_the_lock_stops_nothing(tmp_path, monkeypatch, taken):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "common"))
    monkeypatch.setattr(host, "Path", lambda name: Path(str(name).replace("/tmp", "/none")))
    ours = tmp_path / "common" / f"cembench-{os.geteuid()}"
    (tmp_path / "common").mkdir()
    if taken == "link":
        (tmp_path / "elsewhere").mkdir()
        ours.symlink_to(tmp_path / "elsewhere")
    elif taken == "file":
        ours.touch()
    else:
        ours.mkdir()
        ours.chmod(0o777 if taken == "open to all" else 0o700)
    if taken == "another user's":
        if os.geteuid() != 0:
            pytest.skip("NOT CHECKED: only root can give a folder to another user")
        os.chown(ours, 12345, -1)
    with host.Turn() as turn:
        assert turn.path.parent.parent == host.place() / "locks"
        turn.alone()


def test_a_lock_of_another_users_is_not_taken(tmp_path):
    if os.geteuid() != 0:
        pytest.skip("NOT CHECKED: only root can give a file to another user")
    (tmp_path / "lock").touch()
    os.chown(tmp_path / "lock", 12345, -1)
    with pytest.raises(ClusterError, match="regular file of this user's"):
        host.Turn(tmp_path / "lock").__enter__()


def test_the_page_names_how_dask_is_kept_quiet():
    page = (Path(__file__).parents[3] / "docs" / "cluster.md").read_text()
    for name, value in quiet_variables().items():
        assert page.count(f"{name}={value}") == 2
