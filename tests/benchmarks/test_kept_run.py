"""A run kept without its maps has the same figures, and names no folder of its machine."""

import pytest
from cembench.surfaces.flat_disk import flat_disk

from benchmarks.kept_run import kept_run
from benchmarks.stale import kept_reports, measured_seconds
from cembench.results.store import Store
from tests.papers.invented_run import write


def test_a_kept_run_is_read_again_without_hidden_folders(tmp_path):
    run = write(tmp_path / "run", [flat_disk(200)], {"lscm": 1.0})
    store, secret = Store(run), tmp_path / "secret/programs"
    (record,) = store.records()
    outcome = record.outcome.model_copy(update={"cause": f"in {secret}/map.m"})
    store.save(record.model_copy(update={"outcome": outcome}), None, {"id": "machine", "cpu": "x"})
    kept_run(run, tmp_path / "kept", hide=[secret])
    (kept,) = Store(tmp_path / "kept").records()
    assert kept.outcome.cause == "in programs/map.m"
    assert kept.outcome.metrics == pytest.approx(record.outcome.metrics, rel=1e-5)
    assert kept.cell == record.cell
    assert not list((tmp_path / "kept").rglob("*.npz"))
    assert measured_seconds(str(tmp_path / "kept")) > 0


def test_what_is_no_run_is_not_replaced(tmp_path):
    run = write(tmp_path / "run", [flat_disk(200)], {"lscm": 1.0})
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/letter.txt").write_text("dear")
    with pytest.raises(SystemExit, match="holds no run to replace"):
        kept_run(run, tmp_path / "mine")
    assert (tmp_path / "mine/letter.txt").read_text() == "dear"


def test_kept_runs_are_listed_beside_kept_reports():
    assert {"reports/peers", "reports/papers/openabf"} <= set(kept_reports())
