import pytest
from cembench.surfaces.flat_disk import flat_disk

from benchmarks.pages import ROOT, Table, marks
from benchmarks.surfaces_page import COUNTS, FIGURES, in_order, models, row
from cembench.mesh.files import read_mesh, write_mesh
from cembench.registry import load_registry
from cembench.results.records import MeshFacts
from tests.real_meshes import real_mesh

FOUND = {
    "conformal_energy": 0.5,
    "angle_error_mean_deg": 1.25,
    "angle_error_sd_deg": 2.5,
    "flipped_triangles": 0,
}


def line(name, model, origin):
    facts = MeshFacts(
        vertices=300,
        faces=562,
        boundary_vertices=36,
        non_delaunay_share=0.05,
        paper_row=model,
        origin=origin,
    )
    return row(name, facts, 7, FOUND, 1234.0)


def test_a_model_stands_below_its_stand_in_and_rows_are_in_the_papers_order():
    lines = in_order(
        [
            line("cowboy-hat-stand-in", "Cowboy Hat", "stand-in"),
            line("nefertiti.mat", "Nefertiti", "model"),
            line("nefertiti-stand-in", "Nefertiti", "stand-in"),
        ]
    )
    text = f"{Table(lines, COUNTS)}\n{Table(lines, FIGURES)}"
    rows = [row for row in text.splitlines() if row.startswith("| ") and "| surface" not in row]
    assert rows[:3] == [
        "| nefertiti-stand-in | stand-in for Nefertiti | 562 | 36 | 562 | 34 | 5.0% | 1.2e+03 |",
        "| nefertiti.mat | model Nefertiti | 562 | 36 | 562 | 34 | 5.0% | 1.2e+03 |",
        "| cowboy-hat-stand-in | stand-in for Cowboy Hat | 562 | 36 "
        "| 4,604 | 48 | 5.0% | 1.2e+03 |",
    ]
    assert rows[3] == (
        "| nefertiti-stand-in | stand-in for Nefertiti | 7 | 0.5000 | 1.25 | 2.50 | 0 "
        "| 19 | 0.0278 | 2.65 | 3.35 |"
    )


def test_the_chinese_lion_comes_out_as_printed():
    (found,) = models(load_registry(), [real_mesh("chinese_lion.mat")])
    assert found["mesh"].faces == read_mesh(real_mesh("chinese_lion.obj")).m
    assert found["conformal_energy"] == pytest.approx(0.0143, abs=2e-4)
    assert found["angle_error_sd_deg"] == pytest.approx(2.06, abs=0.01)


def test_a_file_that_is_no_model_is_refused(tmp_path):
    write_mesh(tmp_path / "a.obj", flat_disk(100))
    with pytest.raises(SystemExit, match=r"a\.obj is none of the paper's models"):
        list(models(load_registry(), [tmp_path / "a.obj"]))


def test_the_page_has_all_stand_ins_in_both_tables():
    begin, end = marks("surfaces_page")
    page = (ROOT / "docs/surfaces.md").read_text(encoding="utf-8")
    tables_of_page = page.split(begin)[1].split(end)[0]
    for surface in load_registry().surfaces.values():
        if surface.kept:
            assert tables_of_page.count(f"| {surface.name} | stand-in for ") == 2
