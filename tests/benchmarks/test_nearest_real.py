"""The real surface nearest to a row: distances of logarithms, and a study of two disks."""

import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks import nearest_real as study
from cembench.mesh.files import write_mesh


def test_nearest_is_by_ratios_and_not_by_differences():
    wanted = {"faces": 1000, "boundary": 100, "energy": 0.01}
    near = wanted | {"faces": 2000, "thin": 0.3}
    assert study.distance(wanted, wanted) == 0
    assert study.distance(near, wanted) == pytest.approx(0.693, abs=1e-3)
    assert study.distance(wanted | {"faces": 500}, wanted) == pytest.approx(0.693, abs=1e-3)


def test_every_row_without_a_public_model_has_a_nearest_surface(tmp_path):
    for k, faces in enumerate((200, 900)):
        write_mesh(tmp_path / f"disk-{k}.obj", hemi_ellipsoid(faces, z=2.0 - k))
    about, table = study.nearest_real([str(tmp_path)]).parts
    assert "Nearest of 2 real disks" in about
    assert len(table.rows) == 13
    assert {row["name"] for row in table.rows} <= {"disk-0", "disk-1"}
    assert all(row["r"]["ratio"] > 0 for row in table.rows)
    assert str(table).count("\n| ") == 13
