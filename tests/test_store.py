import json

import numpy as np
import pytest

from cembench.errors import RecordError
from cembench.records import Cell, MeshFacts, Outcome, Record
from cembench.store import Store


@pytest.fixture
def record():
    cell = Cell(algorithm="cem", code_hash="c0de", mesh="lion", mesh_hash="abc")
    facts = MeshFacts(vertices=3, faces=1, boundary_vertices=3, non_delaunay_share=0)
    metrics = {"dilatation_max": float("inf"), "flipped_triangles": 0}
    outcome = Outcome(status="ok", seconds=(0.1, 0.3, 0.2), metrics=metrics)
    return Record(
        cell=cell,
        title="CEM",
        target="disk",
        mesh=facts,
        outcome=outcome,
        environment="e",
        started_at="2026-01-01T00:00:00",
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
