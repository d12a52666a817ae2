"""A kept report is confirmed by a run that agrees with it, and by no other."""

import json
import shutil

import pytest

from benchmarks import confirm as study
from benchmarks import origins, stale
from cembench.report.export import export_rows
from cembench.results.columns import rows
from tests.results.simulated_machines import machine_run


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A run, and a kept report with its records, whose figures can be changed."""
    run = machine_run(tmp_path / "run", 1)
    file = tmp_path / "reports/origins.json"
    file.parent.mkdir()
    about = {"start": origins.MEASURING, "date": "2026-01-01", "hashes": {"harness": "old"}}
    file.write_text(json.dumps({"reports/a": about}))
    monkeypatch.setattr(origins, "FILE", file)
    monkeypatch.setattr(study, "ROOT", tmp_path)
    monkeypatch.setattr(study, "tree_at", lambda commit: origins.working_tree())

    def confirm(*, as_run=False, **changes):
        held = [row | changes for row in rows(run.records(), "cem") if row["seconds_raw"]]
        if as_run:
            shutil.copytree(run.folder, tmp_path / "reports/a")
        else:
            export_rows(held, tmp_path / "reports/a/records.csv", "csv")
        section = study.confirm(tmp_path / "reports/a", run.folder, command="cembench run")
        return section, json.loads(file.read_text())["reports/a"]

    return confirm


def test_a_run_that_agrees_renews_the_marks(kept):
    _, about = kept()
    assert about["hashes"] == origins.hashes(origins.working_tree(), origins.MEASURING)
    how = about["confirmed"]
    assert how["commit"] == "1" * 12
    assert how["cells"] > how["same_verdict"] > 0 == how["one_decides"]
    assert f"at `{how['commit']}` by {how['cells']} cells" in stale.confirmed_words(how)


def test_a_kept_run_is_confirmed_like_a_report(kept):
    _, about = kept(as_run=True)
    assert about["confirmed"]["cells"] >= about["confirmed"]["same_verdict"] > 0


def test_another_map_refuses(kept):
    with pytest.raises(SystemExit, match="15 maps have other figures, and 0 verdicts contradict"):
        kept(conformal_energy=0.5)


def test_a_contradicting_verdict_refuses(kept):
    with pytest.raises(SystemExit, match=r"0 maps have other figures, and [1-9]"):
        kept(verdict="faster")


def test_too_few_cells_refuse(kept, monkeypatch):
    monkeypatch.setattr(study, "LEAST", 1.1)
    with pytest.raises(SystemExit, match="too few"):
        kept()
