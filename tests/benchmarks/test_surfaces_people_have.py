"""The table of inputs that people ask about: kinds made by the study, and what is answered."""

import pytest

from benchmarks.pages import ROOT, filled
from benchmarks.surfaces_people_have import (
    _followed,
    _of_file,
    bow_tie,
    hill,
    klein_bottle,
    pieces,
    soup,
    text,
)
from cembench import DiskMesh, MeshError
from cembench.mesh.repair import repair

PAGE = (ROOT / "docs/repair.md").read_text(encoding="utf-8")


def row(tmp_path, arrays, options=""):
    return _of_file(tmp_path, 0, "kind", ".obj", lambda p: p.write_text(text(*arrays)), options)


def test_a_surface_is_mapped(tmp_path):
    assert row(tmp_path, hill())["answer"] == "mapped"


@pytest.mark.parametrize(
    "arrays", [soup(1e-6), pieces(3), bow_tie()], ids=["soup", "pieces", "bow"]
)
def test_the_options_of_a_refusal_are_followed_to_a_map(tmp_path, arrays):
    found = row(tmp_path, arrays, "--repair")
    assert found["answer"] == "refused, remedy works"
    assert "a repair would keep only" in found["words"]


def test_a_klein_bottle_is_cut_as_its_refusal_says(tmp_path):
    assert row(tmp_path, klein_bottle())["answer"] == "refused, remedy works"


def test_an_error_without_options_names_its_cause(tmp_path):
    assert _followed(tmp_path / "a.obj", MeshError("no")) == "refused, cause named"


def test_the_kept_table_has_no_remedy_that_fails():
    table = PAGE.split("made by benchmarks/surfaces_people_have.py -->")[1].split("<!-- end")[0]
    assert filled(PAGE, "surfaces_people_have", table.strip()) == PAGE
    assert table.count("\n| ") > 30
    assert "remedy fails" not in table
    assert "remedy works" in table


def test_the_patch_is_a_disk():
    assert DiskMesh(*repair(*hill()).surfaces[0]).m == 216
