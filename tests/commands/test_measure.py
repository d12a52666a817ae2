"""The command `measure`."""

import json

import pytest

import cembench


@pytest.fixture
def file(tmp_path):
    mapped = cembench.parameterize(cembench.surface("hemi-ellipsoid", 800), "bff-free")
    cembench.write_mesh(tmp_path / "a.obj", mapped.mesh, mapped.uv)
    return tmp_path / "a.obj"


def test_the_answer_comes_first_then_figures_and_a_picture(file, cli):
    picture = file.with_name("d.png")
    code, out, _ = cli("measure", file, "--preview", picture)
    assert code == 0
    assert "a: 1 island, mean angle error" in out.replace("\n", " ")
    assert out.count("worst: triangle") == 3
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_json_has_all_figures_and_those_of_islands(file, cli):
    code, out, _ = cli("measure", file, "--json")
    data = json.loads(out)
    assert code == 0
    assert data["islands"] == len(data["by_island"]) == 1
    assert data["verdict"].startswith("1 island")


def test_a_picture_is_of_one_file_and_never_over_the_surface(file, cli):
    for more in ((file, "--preview", "x.png"), ("--preview", file), ("--preview", "x.jpg")):
        code, _, err = cli("measure", file, *more)
        assert code == 2
        assert "--preview" in err or "overwritten" in err
