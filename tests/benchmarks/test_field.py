import subprocess
import sys

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.field import PAGE, cell, disks, figures, seconds_table, tables, timed
from cembench import DiskMesh
from cembench.mesh.files import write_mesh
from cembench.registry import load_registry
from tests import gallery

ALGORITHMS = load_registry().algorithms


def test_a_map_a_refusal_and_folds_have_their_cells():
    mesh = hemi_ellipsoid(300)
    one = figures(ALGORITHMS["bff"], mesh)
    assert one["status"] == "ok"
    assert cell(one, "mean") == f"{one['mean']:.4g}"
    assert abs(one["centred"] / one["energy"] - 1) < 0.1
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 6))
    refused = figures(ALGORITHMS["cetm"], strip)
    assert "join boundary vertices" in refused["cause"]
    assert cell(refused, "mean") == "-"
    assert cell({"status": "invalid", "folds": 3}, "mean") == "3 folds"
    assert cell({"status": "ok", "mean": 1.5, "overlap": 0.2}, "mean") == "1.5*"


def test_tables_have_a_row_a_surface_and_a_column_an_algorithm(tmp_path):
    mesh = hemi_ellipsoid(300)
    write_mesh(tmp_path / "one.obj", mesh)
    (tmp_path / "two.obj").write_text("nothing")
    ((name, found),) = disks(tmp_path)
    assert np.array_equal(found.F, mesh.F)
    known = [ALGORITHMS["bff"], ALGORITHMS["scp"]]
    kept = {name: {"triangles": mesh.m, "maps": {a.name: figures(a, mesh) for a in known}}}
    text = "\n".join(tables(kept, known))
    assert text.count("| one.obj |") == 8
    assert "| surface | triangles | bff |" in text
    assert "| surface | triangles | scp |" in text


def test_the_cost_is_told_beside_direct_cem_s_and_a_refusal_is_a_dash(tmp_path):
    write_mesh(tmp_path / "chinese_lion.obj", DiskMesh.from_arrays(*gallery.flat_rectangle(2, 6)))
    known = [ALGORITHMS[name] for name in ("direct-cem", "harmonic-circle", "cetm")]
    costs = timed(tmp_path, known, 60.0)
    assert list(costs) == ["chinese_lion.obj"]
    assert costs["chinese_lion.obj"]["direct-cem"]["seconds"] > 0
    costs["chinese_lion.obj"]["harmonic-circle"] = {"seconds": 0.1234, "ratio": 0.5}
    costs["chinese_lion.obj"]["cetm"] = None
    lines = seconds_table(costs, known).splitlines()
    assert lines[0] == "| algorithm | target | chinese_lion.obj, s | / direct-cem |"
    assert lines[3:] == ["| `harmonic-circle` | disk | 0.123 | 0.50 |", "| `cetm` | disk | - | - |"]


@pytest.mark.parametrize("more", [[], ["--seconds"]])
def test_without_a_surface_the_page_stays_as_it_is(more, tmp_path):
    before = PAGE.read_bytes()
    command = [sys.executable, "-m", "benchmarks.field", str(tmp_path), *more]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "stays as it is" in ended.stderr
    assert PAGE.read_bytes() == before
