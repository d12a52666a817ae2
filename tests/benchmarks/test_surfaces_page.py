import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.rows import ROWS

from benchmarks.pages import ROOT, marks
from benchmarks.surfaces_page import (
    CALIBRATED,
    MODEL,
    OLD,
    PRINTED,
    agreement,
    anatomy_of,
    as_text,
    boundary_corners,
    in_print,
    iterations_words,
    known_models,
    measured,
    predictions,
)
from cembench.mesh.files import write_mesh
from cembench.registry import load_registry
from tests.real_meshes import real_mesh

VASE = "Chinese Vase"


def line(kind, factor=1.0):
    """The printed line of the vase, times a factor."""
    printed = in_print(VASE)
    figures = {name: [factor * one for one in printed[name]] for name in ("fdm", "ldm", "cem")}
    return {"row": VASE, "kind": kind, **figures, "iterations": printed["iterations"]}


def test_only_fitted_figures_of_calibrated_stand_ins_are_marked():
    assert ROWS["chinese-vase-stand-in"].fitted == "fdm"
    assert as_text(line(CALIBRATED))["fdm"] == ["0.0974ᶠ", "4.50ᶠ", "5.02ᶠ"]
    assert as_text(line(CALIBRATED))["cem"] == ["0.0974", "4.50", "5.02"]
    for kind in (PRINTED, MODEL, OLD):
        assert as_text(line(kind))["fdm"] == ["0.0974", "4.50", "5.02"]


def test_predictions_stand_beside_the_printed_figures_of_fdm():
    (first, *_) = predictions([line(PRINTED), line(CALIBRATED, 2.0)])
    assert first["what"] == "LDM: E_C"
    assert first["mean"] == pytest.approx(2)
    assert first["own"]["mean"] == pytest.approx(0.0974 / 0.1141)
    assert (first["near"], first["own"]["near"]) == (0, 1)
    assert agreement([1, 4], [1, 1])["scatter"] == pytest.approx(2)


def test_iterations_are_counted_by_kind():
    off = line(OLD) | {"iterations": 18}
    text = iterations_words([line(PRINTED), line(CALIBRATED), off, line(MODEL)])
    assert "on 1 of 1 stand-ins, on 0 of 1 old ones, and on 1 of 1 models" in text


def test_the_anatomy_of_a_flat_disk_has_no_scatter():
    disk = flat_disk(600)
    np.testing.assert_allclose(boundary_corners(disk), boundary_corners(disk)[0], atol=3)
    assert anatomy_of(disk)["error"] < 0.1
    assert 0 < anatomy_of(disk)["rim"] < 0.5


def test_the_chinese_lion_comes_out_as_printed():
    ((model, mesh),) = known_models([real_mesh("chinese_lion.mat")])
    assert model == "Chinese Lion"
    found = measured(mesh, model)
    assert found["cem"][0] == pytest.approx(0.0143, abs=2e-4)
    assert found["fdm"] == pytest.approx([0.0139, 1.42, 2.04], abs=5e-3)
    assert anatomy_of(mesh)["share"] == pytest.approx(0.69, abs=0.02)


def test_a_file_that_is_no_model_is_refused(tmp_path):
    write_mesh(tmp_path / "a.obj", flat_disk(100))
    with pytest.raises(SystemExit, match=r"a\.obj is none of the paper's models"):
        list(known_models([tmp_path / "a.obj"]))


def test_the_page_has_all_stand_ins():
    begin, end = marks("surfaces_page")
    page = (ROOT / "docs/surfaces.md").read_text(encoding="utf-8")
    tables_of_page = page.split(begin)[1].split(end)[0]
    for surface in load_registry().surfaces.values():
        if surface.kept:
            assert tables_of_page.count(f"| {surface.paper_row} | {CALIBRATED} |") >= 1
