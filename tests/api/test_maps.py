"""Maps that somebody made as columns of a run: judged, without seconds, and never in verdicts."""

import numpy as np
import pytest

import cembench
from cembench.core.errors import ParameterError
from cembench.report.content.evidence import Evidence
from cembench.report.content.standings import contest_of, standings
from cembench.report.declared_plots import declared_plot
from cembench.results.columns import COLUMNS, marks_explained
from cembench.results.store import Store


@pytest.fixture(scope="module")
def surfaces():
    return [cembench.surface(name, 150) for name in ("hemi-ellipsoid", "spherical-cap")]


def run(surfaces, folder, output, **more):
    return cembench.benchmark(
        surfaces, ["cem", "harmonic-circle"], maps={"theirs": folder}, output=output, **more
    )


def test_a_folder_of_maps_is_a_column(tmp_path, surfaces):
    folder = tmp_path / "uvs"
    folder.mkdir()
    best = [cembench.parameterize(one, algorithm="best") for one in surfaces]
    for k, one in enumerate(best):
        one.save(folder / f"{k}.obj")
    rounds = {"rounds": 1}
    measured = run(surfaces, folder, tmp_path / "run", **rounds)
    theirs = [r for r in measured.records() if r.cell.algorithm == "theirs"]
    for record in theirs:
        (mine,) = (one for one in best if one.mesh.hash == record.cell.mesh_hash)
        outcome = record.outcome
        assert (outcome.status, record.target) == ("ok", "disk")
        angle = outcome.metrics["angle_error_mean_deg"]
        assert angle == pytest.approx(mine.metrics["angle_error_mean_deg"], abs=1e-9)
        assert (outcome.rounds, outcome.seconds, outcome.median_seconds) == ((), (), None)
        assert outcome.peak_memory_bytes is outcome.iterations is outcome.work is None
        assert record.external.model_dump() == {"kind": "maps", "name": str(folder)}
        assert any(name.startswith("uvs/") for name in record.sources)

    evidence = Evidence(Store(tmp_path / "run"), tuple(measured.records()), ())
    contest = contest_of(evidence, "reuse")
    assert contest["order"][0] == "theirs (files)"
    assert "theirs (files)" not in contest["good"]
    row = standings(contest).rows[0]
    assert (row[0].text, row[-1].text, row[-1].number) == ("theirs (files)", "-", None)
    profile = declared_plot(evidence, "performance-profile")
    assert profile is not None
    assert not any("theirs" in one.name for panel in profile.panels for one in panel.series)
    assert COLUMNS["seconds"].why_lacking(theirs[0]) == "the map was read from a file"
    assert marks_explained(theirs)[0].startswith("§ maps that somebody made")

    again = run(surfaces, folder, tmp_path / "run", **rounds)
    kept = {record.started_at for record in again.asked} == {r.started_at for r in measured.asked}
    assert kept
    with pytest.raises(ParameterError, match="has this name"):
        cembench.benchmark(surfaces, ["cem"], maps={"lscm": folder}, rounds=1)
    with pytest.raises(ParameterError, match="`maps` are read on this machine"):
        run(surfaces, folder, tmp_path / "run", cluster="local:2", **rounds)


def test_a_surface_without_a_file_is_a_gap_until_it_has_one(tmp_path, surfaces):
    folder, output = tmp_path / "uvs", tmp_path / "run"
    folder.mkdir()
    ellipsoid, cap = surfaces
    cembench.parameterize(cap).save(folder / "cap.obj")

    def status():
        asked = run(surfaces, folder, output, rounds=1).asked
        mine = [one for one in asked if one.cell.algorithm == "theirs"]
        return {one.cell.mesh: (one.outcome.status, one.outcome.cause) for one in mine}

    no_file = "skipped", f"no file in {folder} holds a map of this surface"
    assert status() == {ellipsoid.name: no_file, cap.name: ("ok", None)}
    uv = ellipsoid.V[:, :2].copy()
    uv[0] = uv[1]
    np.savez(folder / "e.npz", V=ellipsoid.V, F=ellipsoid.F, uv=uv)
    held, cause = status()[ellipsoid.name]
    assert held == "invalid"
    assert "folded" in cause
