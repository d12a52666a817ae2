"""The library as a notebook uses it: arrays, meshes, files and names in; results out."""

import doctest
import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_limits

import cembench
from cembench import HoledMaps
from tests import gallery

ROOT = Path(cembench.__file__).parents[1]

#: The modules whose docstrings have examples.
WITH_EXAMPLES = sorted(
    path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
    for path in (ROOT / "cembench").rglob("*.py")
    if ">>> " in path.read_text()
)


@pytest.fixture(scope="module")
def disk():
    return cembench.surface("hemi-ellipsoid", 300)


@pytest.mark.parametrize("kind", ["mesh", "path", "arrays", "lists"])
def test_a_surface_may_be_a_mesh_a_path_or_arrays(disk, kind, tmp_path):
    cembench.write_mesh(tmp_path / "a.obj", disk)
    given = {
        "mesh": disk,
        "path": tmp_path / "a.obj",
        "arrays": (disk.V, disk.F),
        "lists": [disk.V.tolist(), disk.F.tolist()],
    }[kind]
    result = cembench.parameterize(given, "cem")
    assert result.ok
    assert result.uv.shape == (disk.n, 2)
    np.testing.assert_array_equal(result.z, result.uv[:, 0] + 1j * result.uv[:, 1])
    assert result.metrics["flipped_triangles"] == 0
    assert result.seconds == pytest.approx(sum(result.phases.values()))


def test_the_default_algorithm_suits_the_topology(disk):
    assert cembench.parameterize(disk).algorithm.name == "plane"
    ring = cembench.surface("catenoid-ring", 400)
    assert cembench.parameterize(ring).algorithm.name == "plane-holes"
    assert {"koebe-cem", "direct-cem-holes"} <= set(cembench.holes(ring))


def test_a_result_shows_and_saves_itself(disk, tmp_path):
    result = cembench.parameterize(disk)
    assert "plane" in repr(result)
    assert len(repr(result)) < 400
    html = result._repr_html_()
    assert "data:image/png;base64," in html
    assert "conformal energy" in html
    assert result.plot(tmp_path / "a.png").get_size_inches()[0] > 5
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    saved = result.save(tmp_path / "a.obj")
    assert cembench.read_mesh(saved).hash == disk.hash
    with pytest.raises(cembench.ParameterError, match="`overwrite`"):
        result.save(saved)
    result.save(saved, overwrite=True)
    with pytest.raises(cembench.ParameterError, match="the picture is a PNG"):
        result.plot(tmp_path / "a.pdf")
    with pytest.raises(cembench.ParameterError, match=r"use the suffix \.html"):
        result.show(tmp_path / "a.txt")
    assert not [*tmp_path.glob("*.pdf"), *tmp_path.glob("*.txt")]


def test_one_file_or_name_is_a_list_of_one(disk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cembench.write_mesh("a.obj", disk)
    assert [one.ok for one in cembench.map_files("a.obj")] == [True]
    assert [one.ok for one in cembench.parameterize_many("cone")] == [True]


def test_a_notebook_shows_a_plot_once(disk, monkeypatch):
    from matplotlib import pyplot

    result, before = cembench.parameterize(disk), pyplot.get_fignums()
    figure = result.plot()
    assert pyplot.get_fignums() == [*before, figure.number]
    pyplot.close(figure)
    monkeypatch.setattr("cembench.api.parameterize.is_notebook", lambda: True)
    result.plot()
    assert pyplot.get_fignums() == before


def test_the_page_and_the_notices_say_where_one_chart_cannot_serve(disk, monkeypatch, tmp_path):
    result = cembench.parameterize(disk)
    assert not any("islands" in notice for notice in result.notices)
    monkeypatch.setattr("cembench.api.view.needs_islands", lambda metrics: True)
    assert any("islands" in notice for notice in result.notices)
    assert "islands" in result.show(tmp_path / "a.html").read_text()


def test_parameters_are_checked_as_on_the_command_line(disk):
    assert cembench.parameterize(disk, "cem", max_iterations=2).iterations <= 2
    with pytest.raises(cembench.ParameterError, match="max_iterations"):
        cembench.parameterize(disk, "cem", max_iterations=-1)
    with pytest.raises(cembench.ParameterError, match="no chosen algorithm has a parameter"):
        cembench.parameterize(disk, "cem", wings=2)
    with pytest.raises(cembench.RegistryError, match="unknown algorithm 'cme'"):
        cembench.parameterize(disk, "cme")


V, F = gallery.flat_rectangle()
#: An edge of two triangles.
INNER = next(e for t in F for e in (t[:2], t[1:]) if (np.isin(F, e).sum(axis=1) == 2).sum() == 2)
BAD = {
    "swapped": ((F, V), "must|integer|whole"),
    "two columns": ((V[:, :2], F), r"\(n, 3\)|shape"),
    "one-based": ((V, F + 1), "count from 1.*Write F - 1"),
    "negative": ((V, F - 1), "out of range"),
    "NaN": ((np.where(V.max() == V, np.nan, V), F), "NaN|infinite"),
    "infinite": ((np.where(V.max() == V, np.inf, V), F), "NaN|infinite"),
    "five columns": ((V, np.zeros((2, 5), int)), r"\(m, 3\)|shape"),
    "no faces": ((V, np.zeros((0, 3), int)), "no faces|at least|empty"),
    "no vertices": ((np.zeros((0, 3)), F), "vert|out of range"),
    "fractions": ((V, F + 0.5), "integer|whole"),
    "isolated": ((np.vstack([V, [[9, 9, 9]]]), F), "isolated"),
    "degenerate": ((V, np.vstack([F, [[0, 0, 1]]])), "degenerate|repeat|twice"),
    "words": ((V.astype(str), F), "of type"),
    "complex": ((V + 1j, F), "of type complex128"),
    "fin": ((np.vstack([V, [[0, 0, 9]]]), np.vstack([F, [[*INNER, len(V)]]])), "non-manifold"),
    "doubled": ((V, np.vstack([F, F[:1]])), "non-manifold|duplicate"),
    "huge": ((V * 1e200, F), "1e\\+60"),
    "tiny": ((V * 1e-200, F), "1e-60"),
    "two pieces": ((np.vstack([V, V + 99]), np.vstack([F, F + len(V)])), "components"),
    "not a pair": ((V,), "pair of arrays"),
    "a number": (7, "pair of arrays"),
    "no such file": ("nowhere.obj", "no such file"),
    "no such name": ("nowhere", "neither a file nor a registered surface"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_from_python_is_named(what):
    given, message = BAD[what]
    with pytest.raises(cembench.MeshError, match=message):
        cembench.parameterize(given)


@pytest.mark.parametrize("what", [k for k, v in BAD.items() if isinstance(v[0], tuple)][:15])
def test_the_bare_constructor_checks_too(what):
    given, message = BAD[what]
    with pytest.raises(cembench.MeshError, match=message):
        cembench.DiskMesh(*given)


def test_benchmark_gives_tables(disk, tmp_path):
    run = cembench.benchmark(
        [disk, (disk.V * 2, disk.F)], ["harmonic-circle", "lscm"], rounds=1, output=tmp_path / "run"
    )
    table = run.table("harmonic-circle")
    assert isinstance(table, pd.DataFrame)
    assert set(table["surface"]) == {disk.name, "surface-2"}
    assert set(table["status"]) == {"ok"}
    assert max(map(len, table.to_string().splitlines())) <= 80
    assert {"surface", "angle_error_mean_deg"} <= set(run.table(full=True))
    assert len(run.speedups("harmonic-circle")) == 2
    known = {
        row["surface"]: row["verdict"] for _, row in run.speedups("harmonic-circle").iterrows()
    }
    assert set(known.values()) == {"too few rounds"}
    assert "<table" in run._repr_html_()
    again = cembench.benchmark([disk], ["lscm"], rounds=1, output=tmp_path / "run")
    assert len(again.records()) == 4
    with pytest.raises(cembench.ParameterError, match="no surface"):
        cembench.benchmark([])


def test_morph_and_theory_take_what_parameterize_takes(disk):
    result = cembench.morph([disk, (disk.V * [1, 1, 2], disk.F)])
    np.testing.assert_allclose(result.at(0.0), disk.V, atol=1e-9)
    assert cembench.theory(disk).facts["boundary_vertices"] == len(disk.boundary)
    with pytest.raises(cembench.ParameterError, match="two surfaces or more"):
        cembench.morph([disk])


def test_validate_returns_findings():
    result = cembench.validate("harmonic-circle", checks_only=True)
    assert result.algorithm == "harmonic-circle"
    assert result.findings


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_the_examples_in_docstrings_run(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = doctest.testmod(importlib.import_module(module))
    assert outcome.attempted >= 1
    assert not outcome.failed


def test_ten_public_names_have_an_example():
    public = [getattr(cembench, name) for name in cembench.__all__]
    assert sum(">>> " in (value.__doc__ or "") for value in public) >= 10


@pytest.mark.parametrize("kind", ["path", "arrays", "mesh"])
def test_repair_and_cut_take_what_parameterize_takes(kind, tmp_path):
    V, F = gallery.torus()
    (tmp_path / "torus.obj").write_text(gallery.obj_text(V, F))
    given = {
        "path": tmp_path / "torus.obj",
        "arrays": (V, F),
        "mesh": cembench.TriangleMesh(V, F),
    }[kind]
    disk = cembench.cut(given)
    assert isinstance(disk.mesh, cembench.DiskMesh)
    np.testing.assert_array_equal(disk.mesh.V, np.asarray(V)[disk.origin])
    assert cembench.parameterize(disk.mesh).ok
    mended = cembench.repair(given)
    assert len(mended.mesh.loops) == 0
    assert not any(mended.steps.values())
    with pytest.raises(cembench.MeshError, match=r"closed|boundary"):
        cembench.parameterize(given)


def test_repair_says_what_it_did_and_gives_every_component():
    V, F = (np.asarray(a) for a in gallery.two_pieces())
    result = cembench.repair((np.vstack([V, [[np.nan, 0, 0]]]), F), components="all")
    assert [type(mesh) for mesh in result.meshes] == [cembench.DiskMesh] * 2
    assert result.steps["isolated_vertices_removed"] == 1
    assert len(cembench.repair((V, F), drop=True).meshes) == 1


@pytest.mark.parametrize(
    ("given", "options", "error"),
    [
        ((V, F), {"weld": -1}, "weld=-1"),
        ((V, F), {"components": "some"}, "components='some'"),
        (("nowhere.obj"), {}, "no such file"),
        (7, {}, "pair of arrays"),
        ((V, F + 0.5), {}, "integer|whole"),
        ((V, F + len(V)), {}, "nothing can be repaired"),
    ],
)
def test_what_repair_refuses(given, options, error):
    with pytest.raises(cembench.CembenchError, match=error):
        cembench.repair(given, **options)


def test_what_cut_refuses():
    with pytest.raises(cembench.ParameterError, match="vertex 99999"):
        cembench.cut((V, F), through=[99999])
    with pytest.raises(cembench.MeshError, match="components"):
        cembench.cut((np.vstack([V, V + 99]), np.vstack([F, F + len(V)])))


def test_every_public_name_is_there_and_documented():
    for name in cembench.__all__:
        value = getattr(cembench, name)
        assert name == "__version__" or value.__doc__, name


def test_importing_the_package_loads_no_numerical_library():
    code = "import cembench, sys; print([m for m in ('numpy', 'scipy', 'igl') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_package_is_a_command():
    for arguments in (["-m", "cembench", "--version"], ["-m", "cembench", "-h"]):
        done = subprocess.run(
            [sys.executable, *arguments], capture_output=True, text=True, check=True
        )
        assert "cembench" in done.stdout


def test_a_map_is_compared_with_the_bounds_of_the_modulus():
    good = cembench.parameterize(cembench.surface("hemi-ellipsoid", 2000), target="disk")
    proof = good.certificate()
    assert proof.words(good.z[proof.corners]).endswith("within")
    assert "times that" in proof.words(np.exp([0, 2j, 3j, 4j]))
    assert "not in order" in proof.words(good.z[proof.corners[::-1]])
    free = cembench.parameterize(good.mesh, "lscm")
    with pytest.raises(cembench.ParameterError, match="no map to the disk"):
        free.certificate()


def test_map_tells_the_certificate(tmp_path):
    cembench.write_mesh(tmp_path / "a.obj", cembench.surface("hemi-ellipsoid", 2000))
    (mapped,) = cembench.map_files([tmp_path / "a.obj"], certificate=True)
    assert mapped.certificate.endswith("within")
    (mapped,) = cembench.map_files([tmp_path / "a.obj"], "lscm", certificate=True)
    assert mapped.certificate == "only for maps to the disk, with circular holes or without"
    (mapped,) = cembench.map_files([tmp_path / "a.obj"])
    assert mapped.certificate == ""


def test_a_map_of_a_surface_with_holes_that_failed_has_its_cause():
    row = {"mesh": "ring", "algorithm": "koebe-cem", "status": "failed", "cause": "it gave up"}
    result = HoledMaps({}, [row])
    with pytest.raises(cembench.AlgorithmFailed, match="ring / koebe-cem: failed: it gave up"):
        result["koebe-cem"]
    with pytest.raises(KeyError):
        result["lscm"]


def test_a_map_does_not_depend_on_the_threads_of_the_process(disk):
    maps = []
    for count in (1, 2):
        with threadpool_limits(limits=count):
            maps.append(cembench.parameterize(disk, "direct-cem").z)
    np.testing.assert_array_equal(*maps)
