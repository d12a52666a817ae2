"""The kept history: what it measures at a commit, and what its page says."""

import importlib.util
import json

import numpy as np
import pytest

import cembench
from benchmarks import history as study
from benchmarks.history import changes, history
from cembench.conformal.metrics import all_metrics

COMMITS = [letter * 40 for letter in "abcd"]


@pytest.fixture
def suite(tmp_path, monkeypatch):
    """The suite on one small surface."""
    path = study.KEPT / "suite/history.py"
    spec = importlib.util.spec_from_file_location("kept_suite", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    mesh = cembench.surface("cone", 300)
    np.savez(tmp_path / "cone.npz", V=mesh.V, F=mesh.F)
    for name, value in {
        "FOLDER": tmp_path,
        "SURFACES": ["cone"],
        "ALGORITHMS": ["lscm", "later"],
    }.items():
        monkeypatch.setattr(module, name, value)
    return module


def test_a_map_has_the_figures_of_our_metrics_and_what_is_not_there_is_named(suite):
    bench = suite.Maps()
    found = bench.setup_cache()
    mesh = cembench.surface("cone", 300)
    uv = suite.algorithm("lscm")(mesh).uv
    expected = all_metrics(mesh, uv)
    got = found["lscm", "cone"]
    assert got["angle"] == pytest.approx(expected["angle_error_mean_deg"], rel=1e-9)
    assert got["energy"] == pytest.approx(expected["conformal_energy"], rel=1e-9)
    assert got["folds"] == expected["flipped_triangles"] == 0
    bench.setup(found, "lscm", "cone")
    bench.time_map(found, "lscm", "cone")
    tracked = suite.Quality()
    tracked.setup(found, "lscm")
    assert tracked.track_angle_error(found, "lscm") == got["angle"]
    with pytest.raises(NotImplementedError, match="no algorithm later"):
        bench.setup(found, "later", "cone")
    with pytest.raises(NotImplementedError, match="no algorithm later"):
        suite.Quality().setup(found, "later")


def test_every_step_can_be_called(suite):
    bench = suite.Steps()
    for name in bench.params:
        bench.setup(name)
        bench.time_step(name)


def asv_results(cem, lscm):
    """A file of asv: seconds of two algorithms on two surfaces."""
    params = [["'cem'", "'lscm'"], ["'cone'", "'cap'"]]
    maps = [[*cem, *lscm], params]
    angles = [[1.0, lscm[0]], params[:1]]
    return {
        "result_columns": ["result", "params"],
        "results": {
            "history.Maps.time_map": maps,
            "history.Quality.track_angle_error": angles,
            "history.Steps.time_step": [[0.001], [["'solve'"]]],
        },
    }


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Kept figures: CEM becomes four times faster, LSCM appears, a commit cannot be built."""
    monkeypatch.setattr(study, "KEPT", tmp_path)
    (tmp_path / "reference").mkdir()
    (tmp_path / "commits.txt").write_text("\n".join(COMMITS))
    (tmp_path / "steps.toml").write_text('"CEM, `bbbbbbbb`" = "It solves for less."\n')
    none = (None, None)
    for commit, figures in zip(
        COMMITS,
        [((0.1, 0.4), none), ((0.025, 0.1), (2, 1)), ((0.025, 0.1), (1, 2)), (none, none)],
        strict=True,
    ):
        path = tmp_path / f"reference/{commit[:8]}-virtualenv.json"
        path.write_text(json.dumps(asv_results(*figures)))
    return tmp_path


def test_the_page_has_a_sentence_the_steps_and_their_reasons(kept):
    found = history()
    text = str(found)
    assert "the first of 3 commits that has it" in text
    assert "lscm 1.0, cem 4.0" in text
    assert "| cem | `bbbbbbbb` | 200 ms | 50 ms | 0.25 |" in text
    assert "| lscm, mean angle error | `cccccccc` | 2 degrees | 1 degrees | 0.50 |" in text
    assert "**CEM, `bbbbbbbb`.** It solves for less." in text
    assert "impossible to build: `dddddddd`" in text
    assert found.files["history.png"].startswith(b"\x89PNG")


def test_without_figures_the_page_says_how_they_are_made(kept):
    for path in (kept / "reference").iterdir():
        path.unlink()
    assert "`make history`" in str(history())


def test_only_a_change_that_is_large_is_a_step():
    nan = float("nan")
    found = {"cem": [nan, 1.0, 1.1, 2.0], "ldm": [3.0, 1.0, 1.0, 1.0]}
    rows = sorted(changes(found, COMMITS, 1.2, "ms"), key=lambda row: row["number"])
    assert [(row["what"], row["commit"][0]) for row in rows] == [("ldm", "b"), ("cem", "d")]
