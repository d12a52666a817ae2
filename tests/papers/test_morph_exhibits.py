import numpy as np
import pytest
from cembench.papers.cem.morph_exhibits import write_exhibits
from cembench.papers.cem.morphing.morph import morph
from PIL import Image

from cembench.results.exhibits import read_exhibits
from cembench.results.papers import find_paper
from tests.papers.morphing.reliefs import three

FACES = find_paper("cem").exhibits[-1].models


@pytest.fixture(scope="module")
def found():
    return morph(*three())


@pytest.fixture
def run(found, tmp_path):
    """What is laid down for a morph, drawn small."""

    def lay(rows):
        write_exhibits(tmp_path, found, found.metrics(24), "cembench morph", rows, sides=(48, 64))
        return tmp_path, read_exhibits(tmp_path)

    return lay


def test_the_papers_three_faces_are_figures_13_and_14(run):
    _, exhibits = run(FACES)
    assert [exhibit.figure for exhibit in exhibits] == ["Figure 13", "Figure 14"]
    assert {exhibit.origin for exhibit in exhibits} == {"stand-in"}


@pytest.mark.parametrize("rows", [("", "", ""), (*FACES[:2], "")])
def test_other_surfaces_are_no_figure_of_the_paper(run, rows):
    _, exhibits = run(rows)
    assert [exhibit.figure for exhibit in exhibits] == ["", ""]
    assert {exhibit.origin for exhibit in exhibits} == {"surface"}


def test_pages_hold_every_surface_and_moment(run):
    folder, (strip, boards) = run(("", "", ""))
    sizes = {}
    for exhibit in (strip, boards):
        (picture,) = exhibit.pictures
        with Image.open(folder / "exhibits" / exhibit.name / picture.file) as page:
            sizes[exhibit.name] = page.size
            assert np.asarray(page.convert("L")).std() > 5
    assert sizes[strip.name][0] >= 7 * 48
    assert sizes[boards.name][0] >= 3 * 64
    assert sizes[boards.name][1] >= 4 * 64


def test_tables_tell_the_metrics_of_each_registration(found, run):
    _, (strip, boards) = run(("", "", ""))
    (table,) = boards.tables
    assert [row[0] for row in table.rows] == ["calm", "wry"]
    column = table.columns.index("folds")
    assert [row[column] for row in table.rows] == [0, 0]
    assert strip.tables[0].rows[0][0] == found.metrics(24)["largest_acceleration_share"]
