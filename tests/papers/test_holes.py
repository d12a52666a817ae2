import json

import numpy as np
import pytest
from cembench.papers.cem.holes_exhibits import examine_holes
from cembench.surfaces.holed_disk import holed_disk

from cembench.registry import load_registry
from cembench.results.exhibits import read_exhibits
from tests import gallery


@pytest.fixture
def ring(cli):
    """A file with one hole."""
    mesh = holed_disk(600, holes=1)
    (cli.folder / "ring.obj").write_text(gallery.obj_text(mesh.V, mesh.F))
    return mesh


def test_the_verb_lays_down_steps_map_and_table(cli, ring):
    code, out, _ = cli("holes", "ring.obj", "--sweeps", 2, "--run", "r", "--json")
    rows = json.loads(out)
    assert code == 0
    assert {row["algorithm"] for row in rows} >= {"koebe-cem", "harmonic-filled"}
    koebe = next(row for row in rows if row["algorithm"] == "koebe-cem")
    assert koebe["sweeps"] == 1
    assert koebe["boundary_circularity"] < 1e-10
    assert len(koebe["boundaries"]) == 2
    by_key = {exhibit.name: exhibit for exhibit in read_exhibits(cli.folder / "r")}
    assert sorted(by_key) == ["holes", "koebe-map-ring", "koebe-steps-ring"]
    assert by_key["koebe-steps-ring"].figure == "Figure 1"
    assert by_key["koebe-map-ring"].figure == "Figure 7"
    # In each step of the sweep, the boundary that it opened is a circle.
    rows = by_key["koebe-steps-ring"].tables[0].rows
    assert [row[0] for row in rows] == ["hole 1", "outer"]
    assert rows[0][3] < 1e-12
    assert rows[1][2] < 1e-12


def test_its_table_fits_80_columns(cli, ring):
    code, out, err = cli("holes", "ring.obj", "--sweeps", 1, "--run", "r")
    assert code == 0, err
    assert max(map(len, out.splitlines()[:-1])) <= 80
    assert "koebe-cem" in out
    assert "status" in out


def test_another_outer_boundary_by_name(cli, ring):
    _, (hole,) = ring.outer_and_holes()
    code, out, _ = cli(
        *("holes", "ring.obj", "--outer", hole[0], "--sweeps", 1, "--run", "r", "--json")
    )
    assert code == 0
    koebe = next(row for row in json.loads(out) if row["algorithm"] == "koebe-cem")
    assert koebe["boundaries"][0]["vertex"] == int(hole.min())
    assert np.hypot(*koebe["boundaries"][0]["centre"]) < 0.1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "is neither a file nor a registered surface"),
        (["disk.obj"], "single boundary loop"),
        (["closed.obj"], "the surface is closed"),
        (["ring.obj", "--outer", "5000"], "outer=5000: vertex 5000"),
        (["ring.obj", "--sweeps", "0"], "--sweeps"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(arguments, message, cli, ring):
    (cli.folder / "disk.obj").write_text(gallery.obj_text(*gallery.flat_rectangle()))
    (cli.folder / "closed.obj").write_text(gallery.obj_text(*gallery.tetrahedron()))
    code, out, err = cli("holes", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert sorted(path.name for path in cli.folder.iterdir()) == [
        "closed.obj",
        "disk.obj",
        "ring.obj",
    ]


def test_it_tells_its_steps_while_it_works(tmp_path):
    mesh = holed_disk(300, holes=2)
    algorithms = [load_registry().algorithm("koebe-cem")]
    heard = []
    run = (tmp_path / "run", "cembench holes", pytest.fail, heard.append)
    result = examine_holes(mesh, algorithms, None, 2, *run)
    assert list(result) == ["koebe-cem"]
    steps = [words for words in heard if "is a circle" in words]
    assert len(steps) == len(set(steps)) == 2 * len(mesh.loops)
    assert len(heard) == len(steps) + 1 + len(result.rows) + 1
