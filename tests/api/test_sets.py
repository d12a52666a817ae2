"""Sets of surfaces: what they give, what they leave out and say so, and what a run keeps of it."""

import json
import zipfile
from urllib.parse import quote

import pytest
from cembench.surfaces.cone import cone
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.holed_disk import holed_disk

from cembench import ParameterError
from cembench.api.sets import CORPUS_VARIABLE, EXHIBIT, GROUPS, gathered, surfaces_of_set
from cembench.api.surface_collections import MANIFEST, read_manifest
from cembench.mesh.files import read_mesh, write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import load_registry
from cembench.report.content.evidence import Evidence
from cembench.results.exhibits import read_exhibits
from cembench.running.plan import Provenance
from tests.real_meshes import CORPUS as CORPUS_FOLDER
from tests.real_meshes import real_mesh


@pytest.fixture
def folder(tmp_path):
    """Two disks, one of them twice, a surface with a hole, and a file that is no mesh."""
    place = tmp_path / "surfaces"
    (place / "deeper").mkdir(parents=True)
    write_mesh(place / "flat.obj", flat_disk(60))
    write_mesh(place / "same.obj", flat_disk(60))
    write_mesh(place / "deeper" / "flat.obj", cone(60))
    write_mesh(place / "holed.obj", holed_disk(300))
    (place / "damaged.obj").write_text("v 0 0 0\nf 1 2 3\n")
    return place


def test_a_folder_gives_what_it_holds_and_the_reasons_for_the_rest(folder):
    registry = load_registry()
    algorithms = [registry.algorithm("cem")]
    result = gathered(surfaces_of_set(str(folder), registry), registry, algorithms)
    assert [one.name for one in result.surfaces] == ["deeper-flat", "flat"]
    why = {one.name: one.error for one in result.refused}
    assert set(why) == {"damaged", "holed"}
    assert "HoledMesh" in why["holed"]


def test_a_manifest_names_the_surfaces_of_a_folder_and_says_where_they_are_from(folder):
    (folder / MANIFEST).write_text(
        "name\tgroup\tsource\tfamily\tlicence\tfile\n"
        "round\tdeeper\tus/meshes\tcone\tMIT\tdeeper/flat.obj\n"
        "flat\t\tus/meshes\tsheet\n"
    )
    registry = load_registry()
    surfaces = surfaces_of_set(str(folder), registry)
    result = gathered(surfaces, registry, [registry.algorithm("cem")])
    assert [(one.name, one.licence) for one in result.surfaces] == [("round", "MIT"), ("flat", "")]
    assert result.roles == {
        "round": Provenance(source="us/meshes", family="cone"),
        "flat": Provenance(source="us/meshes", family="sheet"),
    }


@pytest.mark.parametrize("table", ["a\tb\n1\t2\n", ""])
def test_another_table_of_that_name_says_nothing_of_a_folder(folder, table):
    (folder / MANIFEST).write_text(table)
    assert read_manifest(folder) == {}


def test_a_manifest_that_is_no_text_is_refused(folder):
    (folder / MANIFEST).write_bytes(b"name\tfamily\n\xff\tx\n")
    with pytest.raises(ParameterError, match=r"MANIFEST.tsv cannot be read as a table: .*UTF-8"):
        list(surfaces_of_set(str(folder), load_registry()))


def test_the_corpus_is_read_from_the_folder_that_a_variable_names(folder, monkeypatch):
    monkeypatch.setenv(CORPUS_VARIABLE, str(folder))
    names = [one.name for one in surfaces_of_set("corpus", load_registry())]
    assert names == ["damaged", "deeper-flat", "flat", "holed", "same"]


def test_faces_of_one_model_are_one_family(monkeypatch):
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(real_mesh("ict/generic_neutral_mesh.obj").parent))
    registry = load_registry()
    surfaces = surfaces_of_set("ict-faces", registry, limit=2)
    result = gathered(surfaces, registry, [registry.algorithm("cem")])
    assert {role.family for role in result.roles.values()} == {"ict-face"}


@pytest.mark.parametrize("name", ["woody", "hand-optcuts", "frog-sofa", "lego", "eight"])
def test_the_catalogue_and_the_corpus_are_of_the_same_meshes(name):
    dataset = load_registry().datasets[name]
    rows = {row["name"]: (file, row) for file, row in read_manifest(CORPUS_FOLDER).items()}
    if not rows:
        pytest.skip("NOT CHECKED: the corpus is not there; set CEMBENCH_CORPUS")
    file, row = rows[name]
    assert (row["family"], row["source"]) == (dataset.family, dataset.source)
    assert row["sha256_of_blob"] == dataset.sha256
    assert dataset.source_url.endswith(quote(f"{row['source']}/{row['commit']}/{row['path']}"))
    assert read_mesh(CORPUS_FOLDER / f"{file}.npz", TriangleMesh).hash == dataset.mesh_hash


def test_an_archive_is_a_set_and_its_names_do_not_clash_with_a_folders(folder, tmp_path):
    archive = tmp_path / "more.zip"
    write_mesh(tmp_path / "flat.obj", flat_disk(80))
    with zipfile.ZipFile(archive, "w") as file:
        file.write(tmp_path / "flat.obj", "flat.obj")
    registry = load_registry()
    items = [
        one for name in (folder, archive) for one in surfaces_of_set(str(name), registry, limit=9)
    ]
    result = gathered(items, registry, [registry.algorithm("cem")])
    assert [one.name for one in result.surfaces] == ["deeper-flat", "flat", "flat-2"]


def test_an_unknown_set_names_those_there_are():
    with pytest.raises(ParameterError, match=r"there is no set 'nowhere'.*real-disks"):
        surfaces_of_set("nowhere", load_registry())


def test_every_group_that_a_set_names_is_in_the_catalogue():
    groups = load_registry().groups
    assert {group for groups in GROUPS.values() for group in groups} <= set(groups)


def test_files_that_cannot_be_fetched_are_given_with_the_reason(monkeypatch, tmp_path):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    monkeypatch.setenv("CEMBENCH_DATA_URL", "http://127.0.0.1:9")
    results = list(surfaces_of_set("real-holes", load_registry(), limit=3))
    assert len(results) == 3
    assert all(one.mesh is None and "cannot fetch" in one.error for one in results)


def test_a_run_over_a_set_has_one_round_and_keeps_what_the_set_gave(cli, folder, tmp_path):
    run = tmp_path / "run"
    code, out, err = cli(
        "run", "--set", str(folder), "-a", "lscm,harmonic-circle", "--jobs", "2", "-o", str(run),
        "--json",
    )  # fmt: skip
    assert code == 0, err
    rows = json.loads(out)
    assert {(row["mesh"], row["algorithm"]) for row in rows} == {
        (mesh, algorithm)
        for mesh in ("flat", "deeper-flat")
        for algorithm in ("lscm", "harmonic-circle")
    }
    assert {row["rounds"] for row in rows} == {1}
    assert "damaged is left out" in err
    (exhibit,) = [one for one in read_exhibits(run) if one.name == EXHIBIT]
    assert exhibit.facts["given"] == 4
    assert exhibit.facts["measured"] == 2
    assert set(exhibit.facts["refused"]) == {"damaged", "holed"}
    assert len(Evidence.of(run).surfaces) == 2


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--limit", "3", "--surfaces", "flat-disk"], "`limit` needs `sets`"),
        (["--set", "EMPTY"], "is accepted by the chosen algorithms"),
        (["--set", "EMPTY", "--repair"], "`repair` is for single files"),
        (["--set", "nowhere"], "there is no set 'nowhere'"),
    ],
)
def test_what_is_refused_changes_nothing(cli, tmp_path, given, words):
    (tmp_path / "empty").mkdir()
    given = [str(tmp_path / "empty") if one == "EMPTY" else one for one in given]
    code, _, err = cli("run", *given, "-o", str(tmp_path / "run"))
    assert code == 2
    assert words in " ".join(err.split())
    assert not (tmp_path / "run").exists()
