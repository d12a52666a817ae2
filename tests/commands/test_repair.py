"""The verbs `repair` and `cut`, and `map` and `run` with --repair and --cut."""

import csv
import json
import re

import numpy as np
import pytest
import trimesh

import cembench
from cembench import DiskMesh, TriangleMesh
from cembench.mesh.files import read_mesh
from cembench.mesh.repair import Step
from tests import gallery
from tests.mesh import broken
from tests.real_meshes import real_mesh


@pytest.fixture
def bad_file(tmp_path):
    path = tmp_path / "bad.obj"
    draft = broken.broken(broken.open_seam, broken.fin, broken.isolated, broken.ear)
    path.write_text(gallery.obj_text(draft.points, draft.faces))
    return path


@pytest.fixture
def torus_file(tmp_path):
    path = tmp_path / "torus.obj"
    path.write_text(gallery.obj_text(*gallery.torus()))
    return path


def test_repair_prints_every_step_and_writes_the_surface(bad_file, cli):
    code, out, _ = cli("repair", bad_file, "-o", "good.obj")
    assert code == 0
    assert len(re.findall(r"^ *[\d,]+  ", out, re.MULTILINE)) == len(Step)
    assert "0  ears dropped" in out
    assert "0  holes filled" in out
    assert "kept: 99.69 % of the area, 385 of 386 triangles and 1 of 1 pieces" in out
    assert "good.obj: 218 vertices, 385 triangles, 1 boundary loops, genus 0" in out
    read_mesh(cli.folder / "good.obj", DiskMesh)


def test_repair_as_json_has_every_step(bad_file, cli):
    code, out, _ = cli("repair", bad_file, "-o", "good.ply", "--json")
    data = json.loads(out)
    assert code == 0
    assert set(data["steps"]) == {step.value for step in Step}
    assert data["steps"]["isolated_vertices_removed"] == 1
    assert data["surfaces"] == [
        {
            "vertices": 218,
            "faces": 385,
            "boundary_loops": 1,
            "genus": 0,
            "output": "good.ply",
            "originals": ["good_vertices.csv", "good_faces.csv"],
        }
    ]


def test_all_components_are_files_of_their_own(tmp_path, cli):
    (tmp_path / "two.obj").write_text(gallery.obj_text(*gallery.two_pieces()))
    code, out, _ = cli(
        "repair", tmp_path / "two.obj", "-o", "part.obj", "--components", "all", "--json"
    )
    assert code == 0
    assert [s["output"] for s in json.loads(out)["surfaces"]] == ["part_1.obj", "part_2.obj"]
    assert sorted(p.name for p in cli.folder.glob("*.obj")) == ["part_1.obj", "part_2.obj"]


def test_the_refusal_names_everything_and_its_command_works(bad_file, cli):
    code, out, err = cli("map", bad_file)
    assert (code, out) == (2, "")
    for cause in ("3 problems", "coincident", "non-manifold edge", "2 connected"):
        assert cause in err
    command = re.search(r"`cembench (repair [^`]*)`", err).group(1)
    assert cli(*command.split())[0] == 0
    assert cli("map", "bad_repaired.obj", "-o", "map.obj")[0] == 0


def test_a_closed_surface_with_defects_is_told_of_both_remedies(tmp_path, cli):
    V, F = gallery.torus()
    path = tmp_path / "closed.obj"
    path.write_text(gallery.obj_text(V, np.vstack([F, F[:1]])))
    code, _, err = cli("map", path)
    assert code == 2
    assert "duplicate" in err
    assert "closed" in err
    assert "genus 1" in err
    repair, cut = re.findall(r"`cembench ([^`]*)`", err)
    assert cli(*repair.split())[0] == 0
    assert cli(*cut.split())[0] == 0
    read_mesh(cli.folder / "closed_cut.obj", DiskMesh)


def test_the_number_of_edges_in_the_refusal_fills_the_holes(tmp_path, cli):
    V, F = gallery.flat_rectangle(9, 9)
    F = F[~(F == 44).any(axis=1)]
    (tmp_path / "hole.obj").write_text(gallery.obj_text(np.delete(V, 44, 0), F - (F > 44)))
    code, _, err = cli("map", tmp_path / "hole.obj", "-a", "direct-cem")
    assert code == 2
    command = re.search(r"`cembench (repair [^`]*--fill-holes 6)`", err).group(1)
    assert cli(*command.split())[0] == 0
    read_mesh(cli.folder / "hole_repaired.obj", DiskMesh)


def test_map_repairs_on_request_and_says_what_it_did(bad_file, cli):
    code, out, err = cli("map", bad_file, "--repair", "-o", "map.obj")
    assert code == 0, err
    assert "repaired: 19 coincident vertices welded" in err
    code, out, _ = cli("map", bad_file, "--repair", "--json")
    assert json.loads(out)["repair"]["vertices_welded"] == 19
    assert json.loads(out)["flipped_triangles"] == 0


def test_run_repairs_on_request(bad_file, cli):
    arguments = ("run", "--mesh", bad_file, "-a", "harmonic-circle", "--dry-run", "--json")
    assert cli(*arguments)[0] == 2
    code, out, _ = cli(*arguments, "--repair")
    assert code == 0
    assert json.loads(out)["cells"][0]["faces"] == 385


def test_cut_writes_the_disk_and_its_seam(torus_file, cli):
    code, out, _ = cli("cut", torus_file, "-o", "disk.obj", "--json")
    data = json.loads(out)
    assert code == 0
    disk = read_mesh(cli.folder / "disk.obj", DiskMesh)
    with (cli.folder / data["seam"]).open() as file:
        original = [int(row["original"]) for row in csv.DictReader(file)]
    V, F = gallery.torus()
    np.testing.assert_array_equal(V[original], disk.V)
    np.testing.assert_array_equal(np.array(original)[disk.F], F)
    assert len(data["cut_edges"]) * 2 == data["boundary_vertices"] == len(disk.boundary)


def test_cut_between_vertices(tmp_path, cli):
    (tmp_path / "torus.obj").write_text(gallery.obj_text(*gallery.torus()))
    code, out, _ = cli(
        "cut", tmp_path / "torus.obj", "-o", "a.ply", "--between", "5", "50", "--json"
    )
    assert code == 0
    assert {5, 50} <= set(np.ravel(json.loads(out)["cut_edges"]).tolist())
    code, _, err = cli("cut", tmp_path / "torus.obj", "-o", "b.ply", "--between", "5", "96")
    assert (code, "from 0 to 95" in err) == (2, True)


def test_stl_would_close_the_cut_again(torus_file, cli):
    code, _, err = cli("cut", torus_file, "-o", "disk.stl")
    assert (code, "allowed here: .obj, .off, .ply" in err) == (2, True)


def test_the_map_of_a_closed_surface_has_uvs_by_corner_on_the_original(cli):
    original = real_mesh("closed/spot_low_resolution.obj")
    code, out, _ = cli("map", original, "--cut", "-a", "direct-cem", "-o", "uv.obj", "--json")
    assert code == 0
    assert json.loads(out)["flipped_triangles"] == 0
    mesh = read_mesh(original, TriangleMesh)
    assert read_mesh(cli.folder / "uv.obj", TriangleMesh).hash == mesh.hash
    loaded = trimesh.load_mesh(cli.folder / "uv.obj", process=False)
    np.testing.assert_allclose(loaded.vertices[loaded.faces], mesh.V[mesh.F], atol=1e-7)
    z = loaded.visual.uv[loaded.faces] @ [1, 1j]
    area = ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag
    assert area.min() > 0
    assert area.sum() / 2 == pytest.approx(np.pi / 4, rel=0.05)  # the unit square's disk


def test_several_files_are_mapped_into_a_folder(tmp_path, cli):
    for name in ("a", "b"):
        (tmp_path / f"{name}.obj").write_text(
            "# mine\n" + gallery.obj_text(*gallery.flat_rectangle())
        )
    files = [tmp_path / "a.obj", tmp_path / "b.obj"]
    code, out, err = cli("map", *files, "-a", "lscm", "-o", "maps", "--json")
    assert code == 0, err
    assert [row["mesh"] for row in json.loads(out)] == ["a", "b"]
    assert sorted(p.name for p in (cli.folder / "maps").iterdir()) == ["a.obj", "b.obj"]
    assert (cli.folder / "maps/a.obj").read_text().startswith("# mine\n")


def test_several_files_need_a_folder_and_names_of_their_own(tmp_path, cli):
    text = gallery.obj_text(*gallery.flat_rectangle())
    (tmp_path / "other").mkdir()
    files = [tmp_path / "a.obj", tmp_path / "other/a.obj"]
    for file in files:
        file.write_text(text)
    (tmp_path / "taken").write_text("mine")
    code, _, err = cli("map", *files, "-o", tmp_path / "taken")
    assert (code, "name a folder with `output`" in err) == (2, True)
    code, _, err = cli("map", *files, "-o", "maps")
    assert (code, "two surfaces would be written to maps/a.obj" in err) == (2, True)
    code, _, err = cli("map", files[0], tmp_path / "missing.obj", "-o", "maps")
    assert code == 2
    assert not list(cli.folder.iterdir())


def test_a_cut_surface_needs_an_algorithm_for_disks(torus_file, cli):
    code, _, err = cli("map", torus_file, "--cut", "-a", "direct-cem-holes")
    assert (code, "direct-cem-holes does not take" in err) == (2, True)


@pytest.mark.parametrize("verb", ["repair", "cut"])
def test_the_input_is_written_over_only_if_forced(verb, torus_file, cli):
    torus_file.write_text("# mine\n" + torus_file.read_text())
    before = torus_file.read_bytes()
    code, _, err = cli(verb, torus_file, "-o", torus_file)
    assert (code, "is the input" in err) == (2, True)
    assert torus_file.read_bytes() == before
    assert cli(verb, torus_file, "-o", torus_file, "--force")[0] == 0
    assert torus_file.read_bytes() != before


def test_files_that_were_not_named_are_not_written_over(torus_file, tmp_path, cli):
    (tmp_path / "two.obj").write_text(gallery.obj_text(*gallery.two_pieces()))
    (tmp_path / "b.obj").write_text(gallery.obj_text(*gallery.flat_rectangle()))
    (cli.folder / "maps").mkdir()
    calls = {
        "disk_seam.csv": ("cut", torus_file, "-o", "disk.obj"),
        "part_1_faces.csv": (
            "repair",
            tmp_path / "two.obj",
            "-o",
            "part.obj",
            "--components",
            "all",
        ),
        "maps/b.obj": ("map", tmp_path / "b.obj", "-a", "lscm", "-o", "maps"),
    }
    for name, call in calls.items():
        (cli.folder / name).write_text("mine")
        code, _, err = cli(*call)
        assert (code, f"{name} already exists" in err) == (2, True)
        assert (cli.folder / name).read_text() == "mine"
        assert cli(*call, "--force")[0] == 0
        assert (cli.folder / name).read_text() != "mine"
    assert {p.name for p in cli.folder.iterdir()} == {
        *("disk_seam.csv", "disk.obj", "part_1.obj", "part_2.obj", "maps"),
        *(f"part_{k}_{of}.csv" for k in (1, 2) for of in ("vertices", "faces")),
    }


def test_two_pictures_of_one_name_are_refused(tmp_path, cli):
    text = gallery.obj_text(*gallery.flat_rectangle())
    (tmp_path / "other").mkdir()
    files = [tmp_path / "a.obj", tmp_path / "other/a.obj"]
    for file in files:
        file.write_text(text)
    code, _, err = cli("map", *files, "-a", "lscm", "--preview")
    assert (code, "two pictures would be written to a_lscm.png" in err) == (2, True)


def test_disks_and_surfaces_with_holes_are_mapped_together(tmp_path, cli):
    (tmp_path / "disk.obj").write_text(gallery.obj_text(*gallery.flat_rectangle()))
    (tmp_path / "tube.obj").write_text(gallery.obj_text(*gallery.tube()))
    code, out, err = cli("map", tmp_path / "disk.obj", tmp_path / "tube.obj", "--json")
    assert code in (0, 1), err
    items = [row["algorithm"] for row in json.loads(out)]
    assert items == ["plane", "plane-holes"]


def test_a_file_keeps_names_of_any_encoding(tmp_path, cli):
    given = b"o caf\xe9 \\\n# ends in a backslash \\\n"
    (tmp_path / "a.obj").write_bytes(given + gallery.obj_text(*gallery.flat_rectangle()).encode())
    code, _, err = cli("map", tmp_path / "a.obj", "-a", "lscm", "-o", "b.obj")
    assert code == 0, err
    assert (cli.folder / "b.obj").read_bytes().startswith(given)
    again = read_mesh(cli.folder / "b.obj", DiskMesh)
    assert again.hash == read_mesh(tmp_path / "a.obj", DiskMesh).hash


def test_a_wrong_scale_is_named_with_the_file_and_not_mended(tmp_path, cli):
    V, F = gallery.flat_rectangle()
    (tmp_path / "huge.obj").write_text(gallery.obj_text(V * 1e200, F))
    for call in (("map",), ("map", "--repair"), ("repair", "-o", "a.obj")):
        code, _, err = cli(call[0], tmp_path / "huge.obj", *call[1:])
        assert code == 2
        assert f"{tmp_path / 'huge.obj'}: a coordinate is 5e+200 in size" in err
        assert "divide all coordinates" in err
        assert "cembench repair" not in err


@pytest.mark.parametrize(
    "options",
    [
        ("--remesh", "r.obj", "--side", 11),
        ("--remesh", "../{here}/r.obj", "--side", 11),
        ("--preview", "--geometry-image", "r.png", "--side", 9),
        ("--checker", "--geometry-image", "r_texture.png", "--side", 9),
    ],
)
def test_two_outputs_of_one_name_are_refused(cli, options):
    cembench.write_mesh(cli.folder / "face.obj", cembench.surface("cone", 200))
    options = [str(one).format(here=cli.folder.name) for one in options]
    code, _, err = cli("map", "face.obj", "-o", "r.obj", *options)
    assert code == 2
    assert "two files would be written to r" in err
    assert [file.name for file in cli.folder.iterdir()] == ["face.obj"]


def test_several_surfaces_have_their_notes_and_certificates(cli):
    for name in ("a", "b"):
        cembench.write_mesh(
            cli.folder / f"{name}.obj", cembench.surface("cylinder-sheet", 800, height=30)
        )
    code, out, _ = cli("map", "a.obj", "b.obj", "--certificate")
    assert code == 0
    assert out.count("far from conformal") == out.count("modulus is between") == 2
    assert cli("map", "a.obj", "b.obj", "-v")[1].count("Dirichlet energy") == 2
