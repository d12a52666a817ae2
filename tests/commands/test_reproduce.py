"""`reproduce`: models from a server on this machine, stand-ins, a run, and its report."""

import hashlib
import json
from dataclasses import replace

import pytest

import cembench
from cembench import registry
from cembench.mesh.datasets import Dataset
from cembench.mesh.files import read_mesh
from cembench.registry import load_registry
from cembench.results.records import Outcome
from cembench.results.store import Store
from cembench.running.timing import CellTimer
from tests.models_server import ModelsServer, content_of
from tests.report.conftest import quick_drawing  # noqa: F401 - a fixture

pytestmark = pytest.mark.usefixtures("quick_drawing")
FOUR = {"cem", "qiem", "fdm", "ldm"}


@pytest.fixture
def one_model(cli, monkeypatch, tmp_path):
    """The paper has two models here: a server has that of one of them."""
    content = content_of("nefertiti")
    (tmp_path / "nefertiti.obj").write_bytes(content)
    model = Dataset(
        "nefertiti", "Nefertiti", "https://example.org/nefertiti.obj",
        hashlib.sha256(content).hexdigest(), "MIT", paper_row="Nefertiti", group="paper",
        mesh_hash=read_mesh(tmp_path / "nefertiti.obj").hash,
    )  # fmt: skip
    known = replace(load_registry(), datasets={"nefertiti": model})
    monkeypatch.setattr(registry, "_installed", lambda: known)
    # Not `surfaces_of`: a module first imported meanwhile would keep the replacement for good.
    monkeypatch.setattr("cembench.results.profiles.models", lambda _: ["Nefertiti", "Cowboy Hat"])
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    with ModelsServer() as server:
        monkeypatch.setenv("CEMBENCH_DATA_URL", server.url)
        yield server


def test_a_model_replaces_its_stand_in_and_all_is_reported(cli, one_model):
    code, out, err = cli("reproduce", "-o", "here", "--budget", "0s", "--json")
    assert code == 0, err
    data = json.loads(out)
    assert data["surfaces"] == {"Nefertiti": "model", "Cowboy Hat": "stand-in"}
    cells = {(cell["mesh"], cell["algorithm"]) for cell in data["cells"]}
    assert cells == {(m, a) for m in ("nefertiti", "cowboy-hat-stand-in") for a in FOUR}
    parameters = {
        (r.cell.mesh, r.cell.algorithm): r.cell.parameters
        for r in Store(cli.folder / "here").records()
    }
    assert parameters["nefertiti", "fdm"]["public_program"]
    assert not parameters["cowboy-hat-stand-in", "fdm"]["public_program"]
    assert data["report"]["claims"]["always-faster"] == "too few rounds"
    assert (cli.folder / "here/report/report.tex").is_file()
    lines = err.splitlines()
    assert lines[:4] == [
        "fetched 1 of the paper's models",
        "the paper's models: Nefertiti",
        "stand-ins: Cowboy Hat",
        "[1/1] made cowboy-hat-stand-in",
    ]


def test_the_call_does_what_the_command_does(cli, one_model, monkeypatch):
    monkeypatch.setattr("cembench.results.profiles.models", lambda _: ["Nefertiti"])
    code, out, err = cli("reproduce", "-o", "here", "--offline", "--budget", "0s", "--json")
    assert code == 0, err
    printed = json.loads(out)
    result = cembench.reproduce(cli.folder / "here", offline=True, budget=0)  # resumes
    assert dict(result.surfaces) == printed["surfaces"]
    cells = {row["algorithm"]: row["conformal_energy"] for row in printed["cells"]}
    metrics = {r.cell.algorithm: r.outcome.metrics["conformal_energy"] for r in result.run.asked}
    assert metrics == cells
    assert result.report.title == printed["report"]["title"]


def test_offline_no_server_is_asked_and_a_failed_cell_ends_with_1(cli, one_model, monkeypatch):
    check = CellTimer.check

    def failing(self, task):
        if task.cell.algorithm == "ldm":
            return Outcome(status="failed", cause="it gave up"), None
        return check(self, task)

    monkeypatch.setattr(CellTimer, "check", failing)
    monkeypatch.setattr("cembench.results.profiles.models", lambda _: ["Nefertiti"])
    code, out, err = cli("reproduce", "-o", "here", "--offline", "--budget", "0s")
    assert code == 1
    assert one_model.asked == 0
    assert err.splitlines()[:2] == ["the paper's models: none", "stand-ins: Nefertiti"]
    assert "error: nefertiti-stand-in / ldm: failed: it gave up" in err
    assert all(f"Table {k}: " in out for k in (1, 2, 3, 4))
    assert max(map(len, out.splitlines()[:-1])) <= 80
    assert out.splitlines()[-1] == f"Report: {cli.folder / 'here/report/index.html'}"


def test_a_budget_that_is_not_a_time_is_refused_before_anything_is_done(cli, one_model):
    code, _, err = cli("reproduce", "--budget", "soon")
    assert code == 2
    assert "budget='soon' is not a time" in err
    assert one_model.asked == 0
    assert not list(cli.folder.iterdir())
