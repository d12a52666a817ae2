import json
import os
import subprocess
import sys

import numpy as np
import pytest

from cembench.core.errors import RecordError
from cembench.results import run_folder
from cembench.results.merging import merge
from cembench.results.records import Cell, Outcome
from cembench.results.store import Store
from tests.records import changed, record_of


@pytest.fixture
def record():
    one = record_of([0.1, 0.3, 0.2], algorithm="cem", mesh="lion", mesh_hash="abc")
    return changed(
        one, outcome={"metrics": {"dilatation_max": float("inf"), "flipped_triangles": 0}}
    )


def test_what_is_saved_is_found_again(record, tmp_path):
    store = Store(tmp_path / "run")
    assert store.find(record.cell) is None
    uv = np.exp(1j * np.arange(3))
    store.save(record, uv, {"id": "e", "cpu": "x"})
    again = store.find(record.cell)
    assert again.cell == record.cell
    assert again.outcome.median_seconds == 0.2
    assert again.outcome.metrics == {"dilatation_max": None, "flipped_triangles": 0}
    np.testing.assert_array_equal(store.uv(record.cell), uv)
    assert store.records() == [again]
    text = next((tmp_path / "run/records").iterdir()).read_text()
    assert json.loads(text, parse_constant=pytest.fail)["outcome"]["status"] == "ok"
    assert json.loads((tmp_path / "run/environments/e.json").read_text())["cpu"] == "x"


def test_the_key_is_the_content_and_not_the_label(record):
    cell = record.cell
    assert cell.model_copy(update={"mesh": "renamed"}).key == cell.key
    for change in (
        {"threads": 2},
        {"solves": "backslash"},
        {"parameters": {"a": 1}},
        {"mesh_hash": "x"},
        {"code_hash": "x"},
        {"repeats": 9},
    ):
        assert cell.model_copy(update=change).key != cell.key


def test_damage_is_said(record, tmp_path):
    store = Store(tmp_path / "run")
    with pytest.raises(RecordError, match="holds no run"):
        store.records()
    store.save(record, None, {})
    assert store.uv(record.cell) is None
    path = next((tmp_path / "run/records").iterdir())
    path.write_text(path.read_text().replace('"schema_version": 1', '"schema_version": 99'))
    with pytest.raises(RecordError, match="schema version 99; this cembench reads 1"):
        store.records()
    path.write_text("{")
    with pytest.raises(RecordError, match="is not a record"):
        store.find(record.cell)


def test_nothing_is_half_written(record, tmp_path, monkeypatch):
    store = Store(tmp_path / "run")

    def fail(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(RecordError, match="cannot be written: No space left"):
        store.save(record, np.zeros(3, complex), {"id": "e"})
    assert not [path for path in (tmp_path / "run").rglob("*") if path.is_file()]


def test_samples_are_kept_by_environment_until_the_record_is_there(record, tmp_path):
    store = Store(tmp_path)
    run_folder.claim(tmp_path)
    samples = store.samples(record.cell, "e")
    assert (samples.check(), samples.uv(), samples.rounds()) == (None, None, {})
    assert store.rounds_done(record.cell) is None
    checked = record.outcome.model_copy(update={"metrics": {"flipped_triangles": 0}})
    samples.save_check(checked, np.ones(3, complex))
    for number in (1, 0):
        samples.save_round(number, record.outcome.rounds[number])
    assert samples.check() == checked
    assert samples.rounds() == {0: record.outcome.rounds[0], 1: record.outcome.rounds[1]}
    assert not store.samples(record.cell, "another machine").rounds()
    assert store.rounds_done(record.cell) == 2
    store.save(record, samples.uv(), {"id": "e"})
    assert store.rounds_done(record.cell) is None


def test_a_line_that_a_kill_cut_short_is_not_there_and_is_cut_off(record, tmp_path):
    samples = Store(tmp_path).samples(record.cell, "e")
    samples.save_round(0, record.outcome.rounds[0])
    with samples.journal.open("ab") as file:
        file.write(b'{"number":1,"rou')
    assert samples.rounds() == {0: record.outcome.rounds[0]}
    samples.save_round(2, record.outcome.rounds[2])
    assert list(samples.rounds()) == [0, 2]


def test_a_damaged_sample_is_said(record, tmp_path):
    samples = Store(tmp_path).samples(record.cell, "e")
    samples.save_round(0, record.outcome.rounds[0])
    samples.journal.write_text('{"number": "none"}\n')
    with pytest.raises(RecordError, match=r"e\.jsonl is damaged: Input should be a valid integer"):
        samples.rounds()


def test_samples_that_cannot_be_written_are_said(record, tmp_path):
    (tmp_path / "samples").touch()
    with pytest.raises(RecordError, match="cannot be written"):
        Store(tmp_path).samples(record.cell, "e").save_round(0, record.outcome.rounds[0])


@pytest.mark.process
def test_a_lock_is_held_by_one_and_what_a_killed_run_left_is_cleared(tmp_path):
    store = Store(tmp_path / "run")
    assert not store.is_locked()
    with store.locked() as scratch:
        assert store.is_locked()
    scratch.mkdir()
    (scratch / "V.npy").touch()
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = [f".draft-{'0' * 12}-{ended.pid}-{'0' * 32}.npz"]
    kept = [f".draft-{'0' * 12}-{os.getpid()}-{'0' * 32}", ".draft-thesis"]
    (tmp_path / "run/maps").mkdir()
    for name in left + kept:
        (tmp_path / "run/maps" / name).touch()
    with store.locked() as again:
        assert again == scratch
        assert not list(scratch.iterdir())
    assert not store.is_locked()
    found = {path.name for path in (tmp_path / "run").iterdir()}
    assert found - {"lock"} == {"cembench.json", "maps"}
    assert sorted(path.name for path in (tmp_path / "run/maps").iterdir()) == sorted(kept)


def test_a_folder_that_cannot_be_locked_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="is a file"), Store(tmp_path / "file").locked():
        pass
    with pytest.raises(RecordError, match="cannot be written"), Store(tmp_path / "file/x").locked():
        pass


def test_merging_takes_the_ok_and_then_the_later_one(record, tmp_path):
    def saved(name, **changes):
        changed = {"started_at": name, **changes}
        store = Store(tmp_path / name)
        store.save(record.model_copy(update=changed), np.ones(3, complex), {"id": "e", "cpu": name})
        return store

    failed = Outcome(status="failed", cause="it did")
    runs = [saved("2001"), saved("2003"), saved("2002"), saved("2004", outcome=failed)]
    runs.append(saved("2000", cell=record.cell.model_copy(update={"threads": 2})))
    into = Store(tmp_path / "all")
    assert merge(runs, into).cells == 2
    assert sorted(r.started_at for r in into.records()) == ["2000", "2003"]
    assert into.uv(record.cell) is not None
    assert merge([runs[0]], into).cells == 2
    assert sorted(r.started_at for r in into.records()) == ["2000", "2003"]


def test_the_plan_is_kept(record, tmp_path):
    store = Store(tmp_path)
    assert store.plan() == []
    store.save_plan([record.cell])
    assert store.plan() == [record.cell]


def test_a_changed_copy_of_a_cell_has_a_key_of_its_own():
    cell = Cell(algorithm="cem", code_hash="c0de", mesh="lion", mesh_hash="abc")
    key = cell.key
    other = cell.model_copy(update={"mesh_hash": "def"})
    assert other.key != key
    assert other.key == Cell(**other.model_dump()).key
    assert cell.model_copy(update={"mesh": "of another name"}).key == key
