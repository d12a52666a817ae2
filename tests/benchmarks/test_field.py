import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.field import cell, disks, field, figures, tables
from benchmarks.field_seconds import costs_on, field_seconds, table
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
    text = "\n".join(str(table) for _, _, table in tables(kept, known))
    assert text.count("| one.obj |") == 8
    assert "| surface | triangles | bff |" in text
    assert "| surface | triangles | scp |" in text


def test_the_cost_is_given_beside_direct_cem_s_and_a_refusal_is_a_dash():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(2, 6))
    known = [ALGORITHMS[name] for name in ("direct-cem", "harmonic-circle", "cetm")]
    costs = costs_on(mesh, known, 60.0)
    assert costs["direct-cem"][0] > 0
    costs |= {"harmonic-circle": (0.1234, 0.5), "cetm": None}
    lines = str(table({"lion.obj": costs}, known)).splitlines()
    assert lines[0] == "| algorithm | target | lion.obj, s | / direct-cem |"
    assert lines[3:] == ["| `harmonic-circle` | disk | 0.123 | 0.50 |", "| `cetm` | disk | - | - |"]


@pytest.mark.parametrize("study", [field, field_seconds])
def test_a_folder_without_a_surface_is_refused(study, tmp_path):
    with pytest.raises(SystemExit, match="has no"):
        study(tmp_path)
