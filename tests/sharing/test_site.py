"""Several runs as a site that needs no network."""

import json
import re
from dataclasses import asdict

import pytest
from cembench.sharing import site
from cembench.sharing.site import about, history, write_site

import cembench
from cembench.core.errors import ParameterError, RecordError
from cembench.report.content.evidence import Evidence
from cembench.report.document import Report
from tests.results.test_machines import cell_of, run_of


def published(tmp_path, number, ldm_seconds, *meshes, **more):
    records = [cell_of("cem", mesh, f"e{number}", 1.0) for mesh in meshes]
    records += [cell_of("ldm", mesh, f"e{number}", ldm_seconds) for mesh in meshes]
    store = run_of(tmp_path / f"run-{number}", f"node-{number}", *records, **more)
    return about(Evidence.of(store.folder), f"run-{number}")


def test_history_averages_over_the_surfaces_that_runs_have_in_common(tmp_path):
    first = published(tmp_path, 1, 4.0, "hat", "cap", git={"commit": "a" * 40, "dirty": True})
    second = published(tmp_path, 2, 9.0, "hat")
    page = history([first, second])
    assert [one.ratio for one in page["ldm"]] == pytest.approx([4.0, 9.0])
    assert all(one.common for one in page["ldm"])
    assert [one.surfaces for one in page["ldm"]] == [1, 1]
    assert first.commits == ("aaaaaaaaaa+",)
    assert first.machines == {"node-1": 4}


def test_runs_without_a_surface_in_common_are_starred(tmp_path):
    page = history([published(tmp_path, 1, 4.0, "hat"), published(tmp_path, 2, 9.0, "cap")])
    assert [str(one) for one in page["ldm"]] == ["4.00 (1*)", "9.00 (1*)"]


def test_ratios_are_never_formed_over_two_machines(tmp_path):
    run_of(tmp_path / "a", "node-1", cell_of("cem", "hat", "e1"))
    store = run_of(tmp_path / "a", "node-2", cell_of("ldm", "hat", "e2"))
    assert about(Evidence.of(store.folder), "a").ratios == {}


def test_what_cannot_be_published_is_said(tmp_path):
    with pytest.raises(ParameterError, match="each run once"):
        write_site([tmp_path, tmp_path / "."], tmp_path / "site")
    with pytest.raises(RecordError, match="holds no run"):
        write_site([tmp_path / "nowhere"], tmp_path / "site")
    assert not (tmp_path / "site").exists()


@pytest.fixture
def reported(monkeypatch):
    """The runs with a report, which has tests of its own."""
    shown = []

    def small_report(evidence, folder, command):
        shown.append(evidence.store.folder.name)
        return Report(command, command, (), ())

    monkeypatch.setattr(site, "build_report", small_report)
    return shown


def test_the_call_and_the_command_publish_the_same(cli, tmp_path, reported):
    published(tmp_path, 1, 4.0, "hat")
    run = tmp_path / "run-1"
    code, out, err = cli("publish", run, "-o", tmp_path / "a", "--json")
    assert code == 0, err
    called = cembench.publish(run, tmp_path / "b")
    assert json.loads(out)["runs"] == json.loads(json.dumps([asdict(one) for one in called]))
    page = "leaderboard/index.html"
    assert (tmp_path / "a" / page).is_file()
    assert (tmp_path / "b" / page).is_file()


def test_a_site_has_an_index_and_a_report_of_each_run_and_asks_nobody(tmp_path, reported):
    for number in (1, 2):
        published(tmp_path, number, 4.0, "hat")
    runs = [tmp_path / "run-2", tmp_path / "run-1"]
    result = write_site(runs, tmp_path / "site")
    assert reported == ["run-2", "run-1"]
    assert [run.name for run in result] == ["run-1", "run-2"]
    page = (tmp_path / "site/index.html").read_text()
    links = re.findall(r'(?:href|src)="([^"]+)"', page)
    pages = {f"{place}/index.html" for place in ("runs/run-1", "runs/run-2", "leaderboard")}
    assert pages | {"figures/history.svg"} == set(links)
    assert all((tmp_path / "site" / link).is_file() for link in links)
    assert "://" not in page
    write_site(runs[:1], tmp_path / "site")
    kept = [path for path in (tmp_path / "site/runs").rglob("*") if path.is_file()]
    assert kept == [tmp_path / "site/runs/run-2/index.html"]
