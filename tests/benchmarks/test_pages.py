"""Tables in pages come from records: what stands there is what the kept report says."""

import re
import shutil

import numpy as np
import pytest

from benchmarks import readme_speedups
from benchmarks.pages import ROOT, filled, marks


def test_readme_says_what_the_kept_report_says():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert filled(readme, "readme_speedups", readme_speedups.table()) == readme


def test_another_report_gives_another_table(tmp_path):
    shutil.copytree(ROOT / "reports/paper/tables", tmp_path / "tables")
    averages = tmp_path / "tables/averages.csv"
    averages.write_text(averages.read_text().replace("15.944080083282037", "7.25"))
    assert "| QIEM | 8.5 | 6.8 | 7.2 |" in readme_speedups.table(tmp_path)


@pytest.mark.parametrize(
    ("report", "policy"), [("standard", "reuse"), ("paper", "reuse"), ("paper", "backslash")]
)
def test_the_rounds_of_the_records_give_the_averages_of_the_tables(report, policy):
    folder = ROOT / "reports" / report
    there = readme_speedups.averages(folder / "tables" / readme_speedups.POLICIES[policy])
    for name in ("QIEM", "FDM", "LDM"):
        found = readme_speedups.ratios(folder / "records.csv", name.lower(), policy)
        figures = np.exp([np.median(np.log(one)) for one in found])
        for reading, average in readme_speedups.AVERAGES.items():
            rate = average(figures) - 1
            assert rate == pytest.approx(float(there[reading][f"{name} here"]))


def test_averages_have_intervals_where_cells_have_six_rounds():
    text = readme_speedups.table(ROOT / "reports/standard")
    lines = text.splitlines()
    assert "backslash" not in lines[0]
    for line in lines[2:]:
        for cell in line.split("|")[4:6]:
            figure, low, high = map(float, re.findall(r"[\d.]+", cell))
            assert low <= figure <= high
            assert low < high
    assert "(" not in readme_speedups.table(ROOT / "reports/paper")


def test_a_report_without_averages_is_refused(tmp_path):
    with pytest.raises(SystemExit, match=r"holds no averages\.csv"):
        readme_speedups.table(tmp_path)


@pytest.mark.parametrize(
    ("page", "maker"),
    [
        ("README.md", "readme_speedups"),
        ("docs/surfaces.md", "surfaces_page"),
        ("docs/paper_models.md", "cem_stopping_rules"),
        ("docs/algorithms.md", "qiem_steps"),
    ],
)
def test_only_what_is_between_the_marks_is_replaced(page, maker):
    text = (ROOT / page).read_text(encoding="utf-8")
    new = filled(text, maker, "another")
    begin, end = marks(maker)
    assert new.split(begin)[0] == text.split(begin)[0]
    assert new.split(end)[1] == text.split(end)[1]
    assert new.split(begin)[1].split(end)[0].strip() == "another"


def test_a_page_without_marks_is_refused():
    with pytest.raises(SystemExit, match="lacks the marks"):
        filled("no marks", "readme_speedups", "")
