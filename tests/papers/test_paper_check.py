"""A paper's folder is checked before anything is measured for it."""

import pytest

import cembench
from cembench.core.errors import ParameterError
from cembench.report.content.evidence import FRAME_COLUMNS, Evidence
from cembench.report.content.paper_check import OF_CLAIMS
from cembench.report.write_report import write_report
from cembench.results.columns import COLUMNS
from cembench.results.papers import papers, read_paper
from tests.report.conftest import drawing_little
from tests.report.small_run import write_run

ABOUT = """
title = "My Maps"
authors = "N. Obody"
place = "Workshop (2025)"
doi = ""
algorithms = ["cem", "lscm", "harmonic-circle"]
reference = "cem"
"""
TABLES = """
[[tables]]
number = 1
file = "t1.csv"
title = "milliseconds"
figures = [{ column = "seconds", digits = 1, unit = "ms" }]
"""
CLAIM = """
[[claims]]
name = "angles"
quote = "angles are small"
place = "S1"
test = "below 90"
algorithms = ["cem"]
holds = "first(angle_error_mean_deg) <= 90"
"""
CELLS = "model,faces,cem,lscm,harmonic-circle\nSheet,58,54.5 ± 2.1,n/a,\u2013\n"


@pytest.fixture
def folder(tmp_path):
    def make(about="", tables=TABLES, claims=CLAIM, cells=CELLS):
        place = tmp_path / "mine"
        place.mkdir(exist_ok=True)
        (place / "paper.toml").write_text(ABOUT + about)
        (place / "tables.toml").write_text(tables)
        (place / "claims.toml").write_text(claims)
        (place / "t1.csv").write_text(cells)
        return place

    return make


def test_deviations_gaps_and_milliseconds_are_read(folder):
    assert cembench.check_paper(folder()) == []
    row = read_paper(folder()).tables[1]["Sheet"]
    assert row == {"faces": 58, "cem": 0.0545, "lscm": None, "harmonic-circle": None}
    assert read_paper(folder()).printed[1].figures[0].digits == 4


def test_a_wrong_cell_is_named_with_its_file_line_and_column(folder):
    (wrong,) = cembench.check_paper(folder(cells=CELLS + "Egg,60,fast,1,2\n"))
    assert "t1.csv: line 3, column 'cem': 'fast' is not a number; allowed are 54.5, 54.5" in wrong


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"claims": CLAIM.replace("first(", "frist(")}, "holds: .*'frist'.*Did you mean first?"),
        ({"claims": CLAIM.replace("<= 90", "<=")}, "holds: .*is no expression"),
        ({"claims": CLAIM.replace('["cem"]', '["cme"]')}, "'cme' is not known.*Did you mean cem"),
        ({"claims": CLAIM + 'figures = "{holdz}"\n'}, "figures: .*'holdz'"),
        ({"about": '[surfaces]\nSheet = "flat-dis"\n'}, "'flat-dis' is not known.*flat-disk"),
        ({"cells": CELLS.replace("54.5 ± 2.1", "54.567")}, "3 digits after the point|6 digits"),
        ({"about": 'headline = ["nothing"]\n'}, "there is no claim 'nothing'"),
    ],
)
def test_names_expressions_and_digits_are_checked(folder, changes, said):
    import re

    wrong = cembench.check_paper(folder(**changes))
    assert re.search(said, " ".join(wrong)), wrong


def test_installed_papers_have_nothing_wrong():
    assert [wrong for name in papers() for wrong in cembench.check_paper(name)] == []


def test_the_command_prints_what_is_wrong_and_ends_with_1(cli, folder):
    code, out, _ = cli("paper", "check", folder())
    assert code == 0
    assert "3 algorithms, 1 model, 1 table and 1 claim; nothing is wrong" in " ".join(out.split())
    code, _, err = cli("paper", "check", folder(cells=CELLS + "Egg,60,fast,1,2\n"))
    assert code == 1
    assert "line 3" in err


def test_the_columns_that_are_known_are_those_of_a_run(tmp_path):
    write_run(tmp_path / "run", ("reuse",))
    frame = Evidence.of(tmp_path / "run").frame
    assert set(frame) == {*COLUMNS, *FRAME_COLUMNS} & set(frame)
    assert not set(OF_CLAIMS) & set(frame)
    assert set(FRAME_COLUMNS) <= set(frame)


def test_claims_over_any_surface_need_no_table_and_one_about_nothing_is_an_error(folder, tmp_path):
    write_run(tmp_path / "run", ("reuse",))
    paper = read_paper(folder(tables=""))
    with drawing_little():
        report = write_report(tmp_path / "run", tmp_path / "report", "c", paper=paper)
    (claim,) = next(s for s in report.sections if s.name == "claims").items[2:]
    assert claim.verdict == "holds"
    assert claim.counted.startswith("3 of 3")
    nothing = read_paper(folder(tables="", claims=CLAIM.replace('["cem"]', '["bff"]')))
    about_nothing = pytest.raises(ParameterError, match="no claim of 'My Maps' is about a surface")
    with drawing_little(), about_nothing:
        write_report(tmp_path / "run", tmp_path / "again", "c", paper=nothing)
