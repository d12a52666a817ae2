import json
import re
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.mesh.files import read_mesh, write_mesh
from cembench.results.exhibits import read_exhibits
from tests import gallery
from tests.papers.morphing.reliefs import NEUTRAL, SMILE, relief, vertices_of
from tests.real_meshes import real_mesh

FAULTY = str(Path(__file__).parents[1] / "running/faulty.py")


@pytest.fixture
def pair(cli):
    """Two files and their landmarks, in the folder where the verb is run."""
    meshes = relief(faces=900), relief(SMILE, faces=700)
    for name, mesh in zip(("calm.obj", "smile.ply"), meshes, strict=True):
        write_mesh(cli.folder / name, mesh)
    rows = [
        f"{key},{a},{b}"
        for (key, a), b in zip(
            vertices_of(meshes[0], NEUTRAL).items(),
            vertices_of(meshes[1], SMILE).values(),
            strict=True,
        )
    ]
    (cli.folder / "marks.csv").write_text("\n".join(["name,calm,smile", *rows]))
    cli.morph = lambda *more: cli("morph", "calm.obj", "smile.ply", *more)
    return cli


def test_two_files_morph_into_films_meshes_and_arrays(pair):
    code, out, err = pair.morph(
        *("--landmarks", "marks.csv", "--frames", 5, "--size", 64, "--json"),
        *("-o", "a.gif", "-o", "a.npz", "-o", "a.obj"),
    )
    assert (code, err) == (0, "")
    data = json.loads(out)
    (row,) = data["registrations"]
    assert row["surface"] == "smile"
    assert row["landmark_error_share"] < 0.01
    assert row["flipped_triangles"] == 0
    assert row["distance_mean_edges"] < 0.5
    assert data["landmarks"] == ["nose", "eye right", "eye left", "mouth"]
    assert set(data["seconds"]) == {"maps", "registration", "frames", "film"}
    first = read_mesh(pair.folder / "calm.obj")
    with np.load(pair.folder / "a.npz") as arrays:
        assert arrays["frames"].shape == (5, first.n, 3)
        np.testing.assert_array_equal(arrays["frames"][0], first.V)
    assert (pair.folder / "a.gif").stat().st_size > 1000
    assert len(list(pair.folder.glob("a_00?.obj"))) == 5


def test_the_figures_are_told_in_words_of_80_columns(pair):
    code, out, _ = pair.morph("--landmarks", "marks.csv", "--frames", 3)
    assert code == 0
    row = next(line.split() for line in out.splitlines() if line.startswith("smile "))
    assert row[-3] == "0"  # folds
    assert re.search(r"lambda +100\n", out)
    assert "add -o FILM.gif" in out
    assert max(map(len, out.splitlines())) <= 80


def test_without_landmarks_curvature_aligns(pair):
    code, out, _ = pair.morph("--landmarks", "none")
    assert code == 0
    assert "landmarks  none: aligned by curvature" in out
    assert re.search(r"lambda +-\n", out)


def test_a_map_that_fails_is_exit_code_1(pair):
    code, out, err = pair.morph(
        "--landmarks", "marks.csv", "-a", "spins", "--plugin", FAULTY, "--timeout", 1
    )
    assert (code, out) == (1, "")
    assert "calm: timeout: not finished after 1 s" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["calm.obj"], "needs two surfaces or more"),
        (
            ["calm.obj", "nobody"],
            "'nobody' is neither a file nor a registered surface; known",
        ),
        (["calm.obj", "nothing.obj"], "nothing.obj: there is no such file"),
        (["calm.obj", "smile.ply", "-o", "a.avi"], "'.avi' is unknown"),
        (["calm.obj", "smile.ply", "--views", "back"], "view 'back' is unknown"),
        (["calm.obj", "smile.ply", "-a", "lscm"], "'free boundary'; a morph needs the disk"),
        (["calm.obj", "smile.ply", "-a", "magic"], "unknown algorithm 'magic'"),
        (["calm.obj", "smile.ply", "--landmarks", "no.csv"], "no.csv cannot be read"),
        (["calm.obj", "smile.ply", "--landmarks", "bad.csv"], "vertex 99999 is out of range"),
        (["calm.obj", "tube.obj"], "tube.obj: the surface has 2 boundary loops"),
        (["closed.obj", "calm.obj"], "closed.obj: the surface is closed"),
        (["calm.obj", "handle.obj"], "handle.obj: the surface has genus 1"),
        (["calm.obj", "holed-cap"], "holed-cap: the surface has .* boundary loops"),
    ],
)
def test_what_cannot_be_morphed_is_refused_with_the_reason(arguments, message, pair):
    for name in ("tube", "closed", "handle"):
        makers = {
            "tube": gallery.tube,
            "closed": gallery.tetrahedron,
            "handle": gallery.punctured_torus,
        }
        (pair.folder / f"{name}.obj").write_text(gallery.obj_text(*makers[name]()))
    (pair.folder / "bad.csv").write_text("nose,99999,3\n")
    before = set(pair.folder.iterdir())
    code, out, err = pair("morph", *arguments)
    assert (code, out) == (2, "")
    assert re.search(message, err), err
    assert "Traceback" not in err
    assert set(pair.folder.iterdir()) == before


@pytest.fixture
def coarse(cli):
    """One disk of 60 triangles as two files; landmarks as pairs of vertices."""
    mesh = flat_disk(60)
    for name in ("a.obj", "b.obj"):
        write_mesh(cli.folder / name, mesh)

    def morph(pairs):
        text = "\n".join(f"m{k},{a},{b}" for k, (a, b) in enumerate(pairs))
        (cli.folder / "marks.csv").write_text(text)
        result = cli("morph", "a.obj", "b.obj", "--landmarks", "marks.csv", "-o", "c.npz")
        assert not (cli.folder / "c.npz").exists()
        return result

    z = mesh.V[mesh.interior, 0] + 1j * mesh.V[mesh.interior, 1]
    return morph, z, mesh.interior


def test_exchanged_landmarks_contradict_the_order(coarse):
    morph, z, inside = coarse
    centre, left, below, right = (inside[np.argmin(np.abs(z - at))] for at in (0, -0.5, -0.5j, 0.5))
    code, out, err = morph([(centre, centre), (left, right), (right, left), (below, below)])
    assert (code, out) == (2, "")
    assert "contradictory order of landmarks: from 'm1' to 'm3'" in err


def test_landmarks_that_cannot_meet_are_exit_code_1(coarse):
    """Two in one direction from the centre, which would have to pass each other."""
    morph, z, inside = coarse
    centre = int(np.argmin(np.abs(z)))
    far = int(np.argmax(np.abs(z)))
    aside = np.abs(np.angle(z / z[far]))
    aside[[centre, far]] = np.inf
    near = int(np.argmin(aside))
    assert aside[near] < np.deg2rad(10)
    code, out, err = morph(inside[[(centre, centre), (near, far), (far, near)]])
    assert (code, out) == (1, "")
    assert "a further step would fold triangles" in err


def test_a_real_face_morphs_into_a_real_head(cli):
    """A mask into a whole head: five landmarks, no folds, and both ways near to the target."""
    face, head = real_mesh("human_face.obj"), real_mesh("max_planck_head.ply")
    marks = Path(__file__).parent / "morphing/human_face-max_planck_head.csv"
    code, out, _ = cli("morph", face, head, "--landmarks", marks, "--frames", 48, "--json")
    assert code == 0
    (row,) = json.loads(out)["registrations"]
    assert row["flipped_triangles"] == 0
    assert row["landmark_error_share"] < 0.01
    assert row["distance_mean_edges"] < 0.5


@pytest.mark.slow
def test_three_expressions_morph_without_folds_and_jumps(cli):
    """Figures 13 and 14 on smaller faces of the same shape."""
    names = ("liu-wry-face-stand-in", "liu-neutral-face-stand-in", "liu-smile-face-stand-in")
    code, out, _ = cli("morph", *names, "--faces", 8000, "--run", "run", "--json")
    assert code == 0
    data = json.loads(out)
    for row in data["registrations"]:
        assert row["flipped_triangles"] == 0
        assert row["landmark_error_share"] < 0.01
        assert row["distance_mean_edges"] < 0.5
    assert data["largest_step_share"] < 0.01
    strip, boards = read_exhibits(cli.folder / "run")
    assert "--faces 8000" in strip.command
    assert strip.facts["registrations"] == data["registrations"]
    assert (strip.figure, boards.figure) == ("Figure 13", "Figure 14")
    assert strip.origin == "stand-in"
