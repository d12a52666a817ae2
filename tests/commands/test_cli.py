import json
import os
import re
import subprocess
import sys

import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.linear_algebra.backends import available_backends
from cembench.mesh.files import write_mesh
from cembench.registry import load_registry
from tests import gallery
from tests.real_meshes import DISKS, real_mesh
from tests.running.test_local import FAULTY


@pytest.fixture
def cap(tmp_path):
    write_mesh(tmp_path / "cap.obj", spherical_cap(600))
    return tmp_path / "cap.obj"


METRICS = {
    "dirichlet_energy",
    "image_area",
    "conformal_energy",
    "angle_error_mean_deg",
    "angle_error_sd_deg",
    "flipped_triangles",
    "dilatation_mean",
    "dilatation_max",
    "boundary_circularity",
}


def test_map_prints_the_metrics_under_their_names(cli, cap):
    code, out, _ = cli("map", cap, "-a", "cem", "-p", "max_iterations=2", "--json")
    data = json.loads(out)
    assert code == 0
    assert set(data) >= METRICS | {"iterations", "seconds", "phases", "status", "notices"}
    assert data["parameters"]["max_iterations"] == 2
    assert data["iterations"] <= 2
    assert not list(cli.folder.iterdir())


def test_map_writes_uvs_and_a_picture(cli, cap):
    code, out, _ = cli("map", cap, "-a", "lscm", "-o", "uv.obj", "--preview")
    assert code == 0
    assert "uv.obj" in out
    assert (cli.folder / "uv.obj").read_text().count("\nvt ") == 331
    assert (cli.folder / "uv.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert max(map(len, out.splitlines())) <= 80


def test_map_takes_the_algorithm_that_fits_the_surface(cli, cap, tmp_path):
    write_mesh(tmp_path / "holes.obj", gallery.three_holes())
    taken = [
        json.loads(cli("map", file, "--json")[1])["algorithm"]
        for file in (cap, tmp_path / "holes.obj")
    ]
    assert taken == ["plane", "plane-holes"]


def test_map_of_an_invalid_result_writes_nothing_and_exits_with_1(cli, cap):
    code, _, err = cli("map", cap, "-a", "mirrored", "--plugin", FAULTY, "-o", "uv.obj")
    assert code == 1
    assert "invalid: the map reverses the surface's orientation" in err
    assert not list(cli.folder.iterdir())


def test_an_invalid_map_is_written_on_request_and_called_invalid(cli, cap):
    arguments = ("map", cap, "-a", "mirrored", "--plugin", FAULTY, "-o", "uv.obj", "--preview")
    code, _, err = cli(*arguments, "--keep-invalid")
    assert code == 1
    assert "invalid: the map reverses the surface's orientation" in err
    assert "written anyway" in err
    assert (cli.folder / "uv.obj").read_text().count("\nvt ") == 331
    assert (cli.folder / "uv.png").exists()
    assert json.loads(cli(*arguments, "--keep-invalid", "--json")[1])["status"] == "invalid"


@pytest.mark.parametrize(
    ("mesh", "algorithm", "told", "instead"),
    [
        (flat_disk(600, stretch=4.0), "harmonic-circle", "far from conformal", ()),
        (hemi_ellipsoid(6400), "cem", "-p cem.stop=change", ("-a", "cem", "-p", "cem.stop=change")),
    ],
)
def test_map_tells_of_a_much_better_map(cli, tmp_path, mesh, algorithm, told, instead):
    write_mesh(tmp_path / "a.obj", mesh)
    code, out, _ = cli("map", tmp_path / "a.obj", "-a", algorithm, "--json")
    assert code == 0
    (note,) = json.loads(out)["notes"]
    assert told in note
    assert json.loads(cli("map", tmp_path / "a.obj", *instead, "--json")[1])["notes"] == []


def test_without_repair_a_folded_map_is_invalid_and_its_folds_are_a_figure(cli, tmp_path):
    write_mesh(tmp_path / "crumpled.obj", gallery.crumpled_disk())
    arguments = ("map", tmp_path / "crumpled.obj", "-a", "harmonic-circle")
    code, out, _ = cli(*arguments, "-p", "repair=false", "--json")
    own = json.loads(out)
    assert (code, own["status"]) == (1, "invalid")
    assert own["folded_before_repair"] == own["flipped_triangles"] == 6
    repaired = json.loads(cli(*arguments, "--json")[1])
    assert (repaired["status"], repaired["folded_before_repair"]) == ("ok", 6)
    assert "folded before repair" in cli(*arguments, "--html", "page.html")[1]
    assert "folded before repair" in (cli.folder / "page.html").read_text()


def test_run_records_shows_and_resumes(cli, cap):
    arguments = (
        *("run", "--mesh", cap, "--surfaces", "flat-disk", "--faces", 600, "-a", "cem,lscm"),
        *("-p", "cem.max_iterations=1", "--repeats", 2, "-o", "here"),
    )
    code, out, err = cli(*arguments)
    assert code == 0
    assert "Records and maps:" in out
    assert "lscm *" in out
    assert "[4/4]" in err
    assert "flat-disk / lscm: ok" in err
    assert len(list((cli.folder / "here/records").glob("*.json"))) == 4
    code, out, err = cli(*arguments, "--json")
    assert "[4/4] flat-disk / lscm: kept" in err
    rows = json.loads(out)
    assert [row["algorithm"] for row in rows] == ["cem", "lscm"] * 2
    assert all(set(row) >= METRICS and len(row["seconds_raw"]) == 2 for row in rows)


def test_run_goes_on_after_a_failure_and_exits_with_1(cli, cap):
    names = ("-a", "raises,good", "--plugin", FAULTY)
    code, out, _ = cli("run", "--mesh", cap, *names, "--rounds", 1, "-o", "here")
    assert code == 1
    assert "ZeroDivisionError: by nothing" in out
    assert [line.split()[-1] for line in out.splitlines()[1:3]] == ["failed", "ok"]
    assert max(map(len, out.splitlines()[:4])) <= 80


def test_list_in_words_and_as_json(cli):
    code, out, _ = cli("list")
    assert code == 0
    assert "harmonic-circle" in out
    assert "spherical-cap" in out
    code, out, _ = cli("list", "algorithms", "--verbose")
    assert "Faithful to Algorithm 1" in out
    assert "spherical-cap" not in out
    data = json.loads(cli("list", "--plugin", FAULTY, "--json")[1])
    assert "folded" in {a["name"] for a in data["algorithms"]}
    assert json.loads(cli("list", "surfaces", "--json")[1]).keys() == {"surfaces"}


def test_doctor_is_well(cli):
    code, out, _ = cli("doctor", "--json")
    assert code == 0
    by_key = {finding["name"]: finding for finding in json.loads(out)}
    assert by_key["cholesky"]["ok"]
    assert by_key["cholesky"]["detail"].startswith(f"{', '.join(available_backends())} (default")


def test_doctor_says_what_is_missing(cli, monkeypatch):
    monkeypatch.setitem(sys.modules, "igl", None)
    code, out, _ = cli("doctor")
    assert code == 1
    assert "pip install libigl" in out


def test_doctor_tells_of_remeshing_and_of_what_was_fetched(cli, monkeypatch, tmp_path):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr("cembench.surfaces.remesh.has_remeshing_filter", lambda: False)
    code, out, _ = cli("doctor")
    assert code == 0
    assert "-- remeshing pymeshlab's filter" in " ".join(out.split())
    assert "apt-get install libopengl0" in out
    assert f"0 of {len(load_registry().datasets)} fetched; kept in" in out
    assert "cembench fetch NAME" in out


def test_a_check_that_breaks_is_a_finding(monkeypatch):
    from importlib.metadata import EntryPoint

    from cembench.api.doctor import CHECKS, doctor

    broken = EntryPoint("mine", "cembench.core.clock:nothing", CHECKS)
    monkeypatch.setattr(
        "cembench.api.doctor.entry_points", lambda group: [broken] if group == CHECKS else []
    )
    (found,) = [finding for finding in doctor() if finding.name == "mine"]
    assert not found.ok
    assert not found.required
    assert "AttributeError" in found.detail


VERBS = [
    "status",
    "show",
    "compare",
    "merge",
    "export",
    "fetch",
    "report",
    "validate",
    "morph",
    "holes",
    "theory",
]


@pytest.mark.parametrize("verb", ["", "list", "map", "run", "reproduce", "doctor", *VERBS])
def test_help_has_an_example(verb, cli):
    code, out, _ = cli(*([verb] if verb else []), "--help")
    assert code == 0
    assert "Usage:" in out
    assert not verb or "Example" in out
    assert max(map(len, out.splitlines())) <= 80
    assert not re.search(r"<(bool|str|path|list)\b", out), "a type of Python as the name of a value"


def test_the_module_runs_as_a_process(tmp_path):
    run = subprocess.run(
        [sys.executable, "-m", "cembench.commands.cli", "map", "nowhere.obj"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"COLUMNS": "80"},
    )
    assert run.returncode == 2
    assert run.stderr.startswith("error: nowhere.obj: there is no such file.")


def real_cells():
    for name in DISKS:
        for algorithm in ("cem", "harmonic-circle", "lscm", "fdm", "ldm", "qiem"):
            slow = algorithm != "cem" and not name.startswith("human_face")
            yield pytest.param(name, algorithm, marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize(("name", "algorithm"), list(real_cells()))
def test_map_ends_ok_on_every_real_disk(cli, name, algorithm):
    code, out, err = cli("map", real_mesh(name), "-a", algorithm, "--json")
    assert code == 0, err
    assert json.loads(out)["flipped_triangles"] == 0


def test_the_maze_is_refused_with_the_premise_it_breaks(cli):
    maze = real_mesh("stress/maze.obj")
    for algorithm in ("cem", "fdm", "ldm"):
        code, _, err = cli("map", maze, "-a", algorithm)
        assert code == 1
        assert "Definition 1 (iv) broken: boundary vertices without an interior neighbour" in err
    assert cli("map", maze, "-a", "harmonic-circle")[0] == 0
