"""Seconds of several machines are marked, and cells of several machines are kept apart."""

import numpy as np
import pytest

from cembench.commands.cli import app
from cembench.report.content.evidence import Evidence
from cembench.report.content.report import machines_section
from cembench.report.content.surface_page import figures_table
from cembench.report.document import Table
from cembench.report.run_tables import machine_lines, results_table
from cembench.results.machines import machine_of, marks, software_differences
from cembench.results.merging import merge, others_of
from cembench.results.store import Store
from cembench.running.cluster.state import ClusterState, MachineState, save_state
from tests.records import changed, record_of
from tests.terminal import printed


def cell_of(algorithm, mesh, environment, seconds=1.0, started="2026-01-01", status="ok"):
    times, sittings = ([seconds], [environment]) if status == "ok" else ([], [])
    record = record_of(
        times, sittings, algorithm=algorithm, mesh=mesh, mesh_hash=mesh * 8, repeats=1
    )
    outcome = {"status": status, "uv_hash": "a"}
    return changed(
        record, title=algorithm, environment=environment, started_at=started, outcome=outcome
    )


def run_of(folder, machine, *records, **more):
    store = Store(folder)
    environment = {"machine": machine, "cpu": "a processor", "cores": 2, **more}
    for record in records:
        store.save(record, np.ones(3, complex), environment | {"id": record.environment})
    return store


@pytest.fixture
def two_machines(tmp_path):
    """Machine one has the hat by both algorithms, two has hat by one of them later, and the cap."""
    one = run_of(
        tmp_path / "1", "node-1", cell_of("cem", "hat", "e1"), cell_of("ldm", "hat", "e1", 4.0)
    )
    two = run_of(
        *(tmp_path / "2", "node-2"),
        cell_of("cem", "hat", "e2", 0.5, "2026-02-02"),
        cell_of("cem", "cap", "e2", 0.5),
        python="3.13",
    )
    return one, two


def test_the_same_cells_are_kept_apart_by_machine_and_conflicts_are_told(two_machines, tmp_path):
    into = Store(tmp_path / "all")
    result = merge(two_machines, into)
    assert result.cells == 3
    environments = into.environments()
    held = {(r.cell.mesh, r.cell.algorithm): r.environment for r in into.records()}
    assert held == {("hat", "cem"): "e1", ("hat", "ldm"): "e1", ("cap", "cem"): "e2"}
    assert {machine_of(e) for e in environments.values()} == {"node-1", "node-2"}
    (other,) = others_of(into)
    assert other.folder == tmp_path / "all/others/node-2"
    assert [(r.cell.mesh, r.outcome.median_seconds) for r in other.records()] == [("hat", 0.5)]
    (conflict,) = result.conflicts
    assert str(conflict) == "hat / cem (reuse): node-1 ok 1 s, node-2 ok 0.5 s"
    assert conflict.same_map


def test_merging_again_changes_nothing_and_a_new_leader_takes_the_place(two_machines, tmp_path):
    into = Store(tmp_path / "all")
    merge(two_machines, into)
    before = {p: p.read_bytes() for p in (tmp_path / "all").rglob("*.json")}
    assert merge(two_machines, into).cells == 3
    assert {p: p.read_bytes() for p in (tmp_path / "all").rglob("*.json")} == before
    more = run_of(
        *(tmp_path / "3", "node-2"), cell_of("ldm", "hat", "e2"), cell_of("qiem", "hat", "e2")
    )
    result = merge([more], into)
    assert {r.environment for r in into.records() if r.cell.mesh == "hat"} == {"e2"}
    others = {o.folder.name: o for o in others_of(into)}
    assert {r.cell.algorithm for r in others["node-1"].records()} == {"cem", "ldm"}
    assert others["node-2"].records() == []
    assert result.cells == 4
    assert all(c.machines == ("node-2", "node-1") for c in result.conflicts)


def test_tables_of_several_machines_mark_seconds_and_say_so(two_machines, tmp_path):
    into = Store(tmp_path / "all")
    merge(two_machines, into)
    records, environments = into.records(), into.environments()
    evidence = Evidence.of(into.folder)
    shown = printed(results_table(evidence))
    assert "1.00 A" in shown
    assert "4.00 A" in shown
    assert "0.500 B" in shown
    assert "Seconds of 2 machines (A: node-1, 2 cells; B: node-2, 1 cell)" in shown
    assert max(map(len, shown.splitlines())) <= 80
    alone = [r for r in records if r.environment == "e1"]
    assert "1.00 A" not in printed(results_table(Evidence(into, tuple(alone), ())))
    assert machine_lines(marks(alone, environments)) == []
    assert "which mixes them" in machine_lines(evidence.machines)[0]
    assert marks(alone, environments).explained() == []
    assert software_differences(records, environments) == ["node-2: python: None / 3.13"]


def test_a_report_of_several_machines_marks_seconds_and_names_other_software(
    two_machines, tmp_path
):
    into = Store(tmp_path / "all")
    merge(two_machines, into)
    evidence = Evidence.of(tmp_path / "all")
    section = machines_section(evidence)
    message = " ".join(str(getattr(item, "words", "")) for item in section.items)
    assert "Seconds of 2 machines" in message
    assert "node-2: python: None / 3.13" in message
    (table,) = [item for item in section.items if isinstance(item, Table)]
    assert [[value.text for value in row] for row in table.rows] == [
        ["A", "node-1", "a processor", "1", "2"],
        ["B", "node-2", "a processor", "1", "1"],
    ]
    cap = next(s for s in evidence.surfaces if s.name == "cap")
    texts = [value.text for row in figures_table(evidence, cap, "x").rows for value in row]
    assert "0.500 B" in texts
    assert machines_section(Evidence.of(tmp_path / "1")) is None


def test_status_shows_machines_and_what_is_left(two_machines, tmp_path, capsys):
    into = Store(tmp_path / "all")
    merge(two_machines, into)
    state = ClusterState(units=4, done=1, seconds_left=7200.0)
    state.machines = [MachineState(machine="node-2", units=1, at="foot: check of ldm")]
    save_state(into.folder, state)
    app(["status", str(into.folder)], standalone_mode=False)
    shown = capsys.readouterr().out
    assert "2  cells measured on node-1" in shown
    assert "cluster: 1 of 4 surfaces with a policy are done, about 2.0 h left" in shown
    assert "1  by a worker on node-2  foot: check of ldm" in shown
