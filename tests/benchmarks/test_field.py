import numpy as np
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.field import cell, disks, figures, tables
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


def test_tables_have_a_row_a_surface_and_a_column_an_algorithm(tmp_path):
    mesh = hemi_ellipsoid(300)
    write_mesh(tmp_path / "one.obj", mesh)
    (tmp_path / "two.obj").write_text("nothing")
    ((name, found),) = disks(tmp_path)
    assert np.array_equal(found.F, mesh.F)
    known = [ALGORITHMS["bff"], ALGORITHMS["scp"]]
    kept = {name: {"triangles": mesh.m, "maps": {a.name: figures(a, mesh) for a in known}}}
    text = "\n".join(tables(kept, known))
    assert text.count("| one.obj |") == 4
    assert "| surface | triangles | bff |" in text
    assert "| surface | triangles | scp |" in text
