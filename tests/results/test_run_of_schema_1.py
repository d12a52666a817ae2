"""A run that was written before notices and faults had kinds: it is read, shown and reported."""

import json
import shutil
from pathlib import Path

import pytest

from cembench.core.notices import Notice, NoticeKind
from cembench.results.records import Record
from cembench.results.store import Store
from tests.report.conftest import quick_drawing  # noqa: F401

KEPT = Path(__file__).with_name("run_of_schema_1")
WRITTEN = [json.loads(path.read_text()) for path in sorted(KEPT.glob("records/*.json"))]


@pytest.fixture
def run(cli):
    return shutil.copytree(KEPT, cli.folder / "run")


def figures(written):
    """What a row tells of a record, out of the record's own JSON."""
    cell, outcome = written["cell"], written["outcome"]
    return {
        "mesh": cell["mesh"],
        "algorithm": cell["algorithm"],
        "status": outcome["status"],
        **outcome["metrics"],
        "iterations": outcome["iterations"],
        "seconds_calls": [r["calls"] for r in outcome["rounds"]],
        "energy_history": outcome["energy_history"],
        "extras": outcome["extras"],
        "notes": outcome["notes"],
        "notices": written["mesh"]["notices"],
        "environment": written["environment"],
    }


def test_it_is_of_that_time():
    assert len(WRITTEN) == 3
    assert all(w["schema_version"] == 1 and "faults" not in w["outcome"] for w in WRITTEN)


def test_every_record_has_its_figures_and_its_key(run):
    records = Store(run).records()
    assert {r.cell.key[:12] for r in records} == {p.stem[-12:] for p in KEPT.glob("records/*")}
    for record in records:
        again = json.loads(record.model_dump_json())
        (written,) = [w for w in WRITTEN if w["cell"] == again["cell"]]
        assert again["outcome"]["metrics"] == written["outcome"]["metrics"]
        calls = [[r["calls"] for r in w["outcome"]["rounds"]] for w in (again, written)]
        assert calls[0] == calls[1]
        assert record.outcome.faults == ()


def test_status_finds_maps_and_figures_that_agree(cli, run):
    code, out, _ = cli("status", run, "--verify", "--json")
    assert code == 0
    told = json.loads(out)
    assert told["states"] == {"ok": 1}  # its plan is that of the last of its two sittings
    assert told["recorded_besides"] == 2
    assert [f["kind"] for f in told["findings"]] == ["not signed"] * 3


@pytest.mark.parametrize("written", WRITTEN, ids=lambda w: w["cell"]["algorithm"])
def test_show_tells_the_figures(written, cli, run):
    cell = f"{written['cell']['mesh']}/{written['cell']['algorithm']}"
    code, out, _ = cli("show", cell, "--run", run, "--json")
    assert code == 0
    (row,) = json.loads(out)
    assert figures(written).items() <= row.items()
    assert cli("show", cell, "--run", run)[0] == 0


def test_export_holds_the_figures(cli, run):
    assert cli("export", run, "--format", "json", "-o", "rows.json")[0] == 0
    rows = {(r["mesh"], r["algorithm"]): r for r in json.loads(Path("rows.json").read_text())}
    assert len(rows) == len(WRITTEN)
    for written in WRITTEN:
        expected = figures(written)
        assert expected.items() <= rows[expected["mesh"], expected["algorithm"]].items()


@pytest.mark.usefixtures("quick_drawing")
def test_report_shows_it(cli, run):
    assert cli("report", run, "-o", "here")[0] == 0
    table = Path("here/records.csv").read_text()
    for written in WRITTEN:
        assert str(written["outcome"]["metrics"]["conformal_energy"]) in table


def test_notices_of_that_time_were_plain_texts():
    written = json.loads(json.dumps(WRITTEN[0]))
    broken = "Definition 1 (iv) broken: boundary vertices without an interior neighbour: 3"
    written["mesh"]["notices"] = ["4 polygons were cut into triangles", broken]
    written["outcome"]["notes"] = ["far from conformal"]
    record = Record.model_validate_json(json.dumps(written))
    assert [n.kind for n in record.mesh.notices] == [NoticeKind.OTHER, NoticeKind.DEFINITION_1]
    assert list(map(str, record.mesh.notices)) == written["mesh"]["notices"]
    assert record.outcome.notes == (Notice(NoticeKind.OTHER, "far from conformal"),)
    assert Record.model_validate_json(record.model_dump_json()) == record
