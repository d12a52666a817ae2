"""Bad files at the command line: each its own message, exit code 2, nothing written."""

import json
import os
import re

import numpy as np
import pytest

from tests import gallery
from tests.real_meshes import real_mesh

V, F = gallery.flat_rectangle()


def obj(V, F):
    return gallery.obj_text(V, F)


FILES = {
    "empty.obj": ("", "the file is empty"),
    "a.xyz": ("0 0 0\n", "unknown mesh format '.xyz'; allowed: .obj, .off, .ply, .stl"),
    "points.obj": ("v 0 0 0\nv 1 0 0\n", "no faces: 2 vertices were found"),
    "prose.obj": ("hello world\n", "no faces"),
    "prose.off": ("hello world\n", "line 1, 'hello world': 'hello' is not"),
    "prose.ply": ("hello world\n", "cannot be read as PLY"),
    "prose.stl": ("hello world\n", "cannot be read as STL|no faces"),
    "cut.off": ("OFF\n4 2 0\n0 0 0\n1 0 0\n", "4 vertices are declared, but 2 were found"),
    "letters.obj": ("v a b c\nf 1 1 1\n", "line 1, 'v a b c': 'a' is not a number"),
    "flat.obj": ("v 0 0\nv 1 0\nv 1 1\nf 1 2 3\n", "line 1, 'v 0 0': a vertex needs 3 numbers"),
    "nan.obj": (obj(np.where(V == 3, np.nan, V), F), "NaN or infinite at vertex 3, 9"),
    "inf.obj": (obj(np.where(V == 3, np.inf, V), F), "NaN or infinite"),
    "range.obj": (obj(V, np.where(F == 5, 77, F)), "vertex index out of range"),
    "zero.obj": (obj(V, F).replace("f 1 ", "f 0 "), "vertex index out of range"),
    "degenerate.obj": (obj(np.where(V == [[0, 0, 0]], V[1], V), F), "degenerate triangles"),
    "edge.obj": (obj(*gallery.three_triangles_on_an_edge()), "non-manifold edge"),
    "vertex.obj": (obj(*gallery.bow_tie()), "non-manifold vertex 0"),
    "moebius.obj": (obj(*gallery.moebius_strip()), "one-sided"),
    "pieces.obj": (obj(*gallery.two_pieces()), "2 connected components"),
    "closed.obj": (obj(*gallery.tetrahedron()), "the surface is closed"),
    "tube.obj": (obj(*gallery.tube()), "2 boundary loops"),
    "handle.obj": (obj(*gallery.punctured_torus()), "genus 1"),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("verb", ["map", "run"])
def test_each_bad_file_has_its_own_message(name, verb, cli, tmp_path):
    text, message = FILES[name]
    if (name, verb) == ("pieces.obj", "map"):
        pytest.skip("map takes several surfaces in one file: tests/api/test_components.py")
    (tmp_path / name).write_text(text)
    where = [tmp_path / name] if verb == "map" else ["--mesh", tmp_path / name]
    more = ["-o", "out.obj", "--preview"] if verb == "map" else ["-o", "out"]
    code, out, err = cli(verb, *where, "-a", "cem", *more)
    assert code == 2
    assert out == ""
    assert str(tmp_path / name) in err
    assert "Traceback" not in err
    assert re.search(message, err), err
    assert not list(cli.folder.iterdir())


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_a_text_in_utf_16_is_named_as_such(encoding, cli, tmp_path):
    text = obj(V, F) if encoding == "utf-16" else f"\ufeff{obj(V, F)}"
    (tmp_path / "shell.obj").write_bytes(text.encode(encoding))
    code, _, err = cli("map", tmp_path / "shell.obj")
    assert code == 2
    assert "shell.obj: it is text in UTF-16" in " ".join(err.split())


def test_a_missing_file_and_a_folder(cli, tmp_path):
    code, _, err = cli("map", "nowhere.obj")
    assert (code, "there is no such file" in err) == (2, True)
    code, _, err = cli("map", tmp_path)
    assert (code, "this is a folder" in err) == (2, True)


def test_the_real_punctured_torus(cli):
    code, _, err = cli("map", real_mesh("stress/punctured_torus.obj"))
    assert (code, "genus 1" in err) == (2, True)


@pytest.mark.process
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-a", "nope"], "unknown algorithm 'nope'; known: .*cem.*harmonic-circle.*lscm"),
        (["-p", "speed=1"], "cem has no parameter|no chosen algorithm has a parameter 'speed'"),
        (["-a", "cem", "-p", "max_iterations=-1"], "max_iterations='-1' is not allowed"),
        (["-a", "cem", "-p", "tolerance=abc"], "tolerance='abc' is not allowed"),
        (["-p", "tolerance"], "not of the form NAME=VALUE"),
        (["-o", "a.off"], "cannot hold texture coordinates; allowed here: .obj, .ply"),
        (["-o", "no/where/a.obj"], "there is no folder"),
        (["--plugin", "none.py"], "there is no such file"),
        (["--plugin", "cembench.core.clock:phase"], "declares nothing; decorate a function"),
        (["--plugin", "what.is.this:x"], "cannot be imported"),
        (["--plugin", "nonsense"], "neither a Python file"),
    ],
)
def test_bad_usage(arguments, message, cli, tmp_path):
    (tmp_path / "good.obj").write_text(obj(V, F))
    code, out, err = cli("map", tmp_path / "good.obj", *arguments)
    assert (code, out) == (2, "")
    assert re.search(message, err), err
    assert not list(cli.folder.iterdir())


def test_run_needs_something_to_run_on(cli):
    code, _, err = cli("run")
    assert (code, "there is no surface to measure on" in err) == (2, True)


def test_two_surfaces_of_one_name(cli, tmp_path):
    for folder, size in (("a", 1), ("b", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "same.obj").write_text(obj(size * np.asarray(V), F))
    code, _, err = cli("run", "--mesh", tmp_path / "a/same.obj", "--mesh", tmp_path / "b/same.obj")
    assert (code, "two different surfaces are called 'same'" in err) == (2, True)


def test_a_tube_goes_to_the_algorithms_that_take_holes(cli, tmp_path):
    (tmp_path / "tube.obj").write_text(FILES["tube.obj"][0])
    code, out, _ = cli("run", "--mesh", tmp_path / "tube.obj", "--dry-run", "--json")
    assert code == 0
    assert {cell["algorithm"] for cell in json.loads(out)["cells"]} >= {"koebe-cem"}
    assert "cem" not in {cell["algorithm"] for cell in json.loads(out)["cells"]}


def test_a_folder_of_meshes_leaves_nothing_out_in_silence(cli, tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "good.obj").write_text(obj(V, F))
    (tmp_path / "meshes" / "notes.txt").write_text("no mesh")
    odd = tmp_path / "meshes" / "odd.obj"
    for make, message in (
        (odd.mkdir, "this is a folder"),
        (lambda: os.mkfifo(odd), "this is a pipe"),
        (
            lambda: odd.symlink_to("nowhere"),
            "this is a symbolic link to nowhere, which does not exist",
        ),
        (lambda: odd.write_bytes(b"ply\nformat"), "no faces"),
    ):
        make()
        code, out, err = cli("run", "--mesh-dir", tmp_path / "meshes", "-a", "cem", "--dry-run")
        assert (code, f"odd.obj is left out: {odd}: {message}" in err) == (0, True), err
        assert "good" in out
        odd.rmdir() if odd.is_dir() else odd.unlink()
    assert cli("run", "--mesh-dir", tmp_path / "meshes", "-a", "cem", "--dry-run")[0] == 0


def test_a_folder_that_is_none_or_holds_no_mesh(cli, tmp_path):
    for folder, message in (
        (tmp_path / "nowhere", "is not a folder"),
        (tmp_path, "holds no file of a mesh (.obj, .off,"),
    ):
        code, _, err = cli("run", "--mesh-dir", folder)
        assert (code, f"mesh_dir={str(folder)!r} {message}" in err) == (2, True), err
