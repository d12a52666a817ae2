"""The study of UVs that public models come with, on two surfaces of known answers."""

import numpy as np
from cembench.surfaces.flat_disk import flat_disk

import cembench
from benchmarks import measured_uvs as study


def test_a_model_is_measured_and_a_flat_one_is_left_out(tmp_path, monkeypatch):
    mesh = cembench.surface("hemi-ellipsoid", 300)
    cembench.write_mesh(tmp_path / "seen.obj", mesh, mesh.V[:, :2] / 4 + 0.5)
    flat = flat_disk(100)
    cembench.write_mesh(tmp_path / "flat.obj", flat, flat.V[:, :2] / 4 + 0.5)
    cembench.write_mesh(tmp_path / "bare.obj", mesh)
    names = ("bare", "flat", "seen")
    rows = {name: study._row(name, tmp_path / f"{name}.obj") for name in names}
    assert rows["bare"] is rows["flat"] is None
    row = rows["seen"]
    assert row["islands"] == 1
    np.testing.assert_allclose(row["again"], row["chart"])  # it has no seams
    assert row["chart"] < row["made"]
    words = study._words([row, row | {"made": 0.0}], 3)
    assert words.startswith("**The UVs of 1 of 2 public models have larger angle errors than one")
    assert "Of 3 public surfaces" in words
