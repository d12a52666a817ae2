"""Tables in pages come from records: what stands there is what the kept report says."""

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from benchmarks import cem_speedups, readme_answer
from benchmarks.__main__ import main, parser_of, studies
from benchmarks.kept_report import DIGITS
from benchmarks.pages import ROOT, Section, Table, filled, marks


def speedups(report=cem_speedups.KEPT):
    return str(cem_speedups.cem_speedups(report=report))


def test_readme_says_what_the_kept_report_says():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert filled(readme, "readme_answer", str(readme_answer.readme_answer())) == readme
    page = (ROOT / "docs/papers.md").read_text(encoding="utf-8")
    assert filled(page, "cem_speedups", speedups()) == page


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 100


@pytest.mark.parametrize("policy", cem_speedups.POLICIES)
def test_the_averages_are_those_of_the_rounds_of_the_records(policy):
    """Recomputed from the ratios of each record, on models and on stand-ins apart."""
    rounded = 10.0 ** (1 - DIGITS)  # a ratio of two seconds in the records
    for name in ("qiem", "fdm", "ldm"):
        for origin in cem_speedups.ORIGINS:
            rows = cem_speedups.rates(cem_speedups.KEPT, name, policy, origin)
            assert {row["origin"] for row in rows} == {origin}
            figures = np.exp([np.median(np.log(json.loads(row["ratios"]))) for row in rows])
            mean = float(cem_speedups.averages(rows)[0].partition(" ")[0])
            assert mean == pytest.approx(figures.mean() - 1, rel=rounded, abs=0.051)


def test_models_and_stand_ins_are_no_votes_for_each_other():
    lines = speedups().splitlines()[2:]
    assert [line.split("|")[2].strip() for line in lines] == ["7 models", "13 stand-ins"] * 1 + [
        *("7 models", "11 stand-ins"),  # the paper has no FDM on two models
        *("7 models", "13 stand-ins"),
    ]


def test_averages_have_intervals_where_cells_have_six_rounds():
    cells = [cell for line in speedups().splitlines()[2:] for cell in line.split("|")[5:9]]
    known = [cell for cell in cells if "(" in cell]
    assert len(known) == len(cells) == 24
    for cell in known:
        figure, low, high = map(float, re.findall(r"-?[\d.]+", cell))
        assert low <= figure <= high
        assert low < high


def pages():
    """Every page with a study's marks, and the study."""
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for name in re.findall(r"<!-- made by benchmarks/(\w+)\.py -->", page.read_text()):
            yield page.relative_to(ROOT), name


@pytest.mark.parametrize(("page", "maker"), list(pages()))
def test_only_what_is_between_the_marks_is_replaced(page, maker):
    text = (ROOT / page).read_text(encoding="utf-8")
    new = filled(text, maker, "another")
    begin, end = marks(maker)
    assert new.split(begin)[0] == text.split(begin)[0]
    assert new.split(end)[1] == text.split(end)[1]
    assert new.split(begin)[1].split(end)[0].strip() == "another"
    assert maker in studies()


def test_a_page_without_marks_is_refused():
    with pytest.raises(SystemExit, match="lacks the marks"):
        filled("no marks", "cem_speedups", "")


def test_a_row_without_a_value_has_a_dash_and_the_frame_keeps_the_figures():
    layout = "| a | b |\n|---|---:|\n| {a} | {b[x y]:.1f} |"
    table = Table([{"a": "one", "b": {"x y": 1.25}}, {"a": "two", "b": {"x y": None}}], layout)
    assert str(table).splitlines()[2:] == ["| one | 1.2 |", "| two | - |"]
    assert table.frame["b.x y"].tolist()[0] == 1.25


def test_a_signature_becomes_a_command_line():
    def study(
        surfaces: Sequence[str] = ("1",),
        *,
        rounds: int = 5,
        folder: Path | None = None,
        clock: Literal["wall", "cpu"] = "wall",
        holes: Sequence[int] = (1, 2),
        fast: bool = False,
    ):
        """Study."""

    words = ["a", "b", "--holes", "3", "--folder", "x", "--holes", "4", "5", "--fast"]
    asked = parser_of(study).parse_args(words)
    assert vars(asked) == {
        **{"surfaces": ["a", "b"], "rounds": 5, "folder": Path("x"), "clock": "wall"},
        **{"holes": [3, 4, 5], "fast": True},
    }
    assert parser_of(study).parse_args([]).surfaces == ("1",)
    assert parser_of(study).parse_args([]).holes is None  # then the study's own default counts
    with pytest.raises(SystemExit):
        parser_of(study).parse_args(["--clock", "sun"])


def test_every_study_is_listed_with_what_it_does(capsys):
    main([])
    listed = capsys.readouterr().out
    for name, summary in studies().items():
        assert summary.endswith(".")
        assert f"{name} " in listed


def test_every_study_has_a_command_line():
    # In another process: a study may change what a process starts.
    program = """
from benchmarks.__main__ import import_module, parser_of, studies
for name in studies():
    print(parser_of(getattr(import_module(f"benchmarks.{name}"), name)).format_help())
"""
    command = [sys.executable, "-c", program]
    usage = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert [usage.count(f"usage: python -m benchmarks {name} ") for name in studies()] == [
        1 for _ in studies()
    ]


def test_an_unknown_study_is_refused_with_the_known_ones():
    with pytest.raises(SystemExit, match=r"no study 'limits'; there are aa, .*limit"):
        main(["limits"])


def test_a_study_is_printed_and_its_tables_are_written_where_asked(tmp_path, capsys):
    main(["cem-speedups", "--report", "reports/paper", "--save", str(tmp_path / "out")])
    assert "| QIEM |" in capsys.readouterr().out
    assert "QIEM" in (tmp_path / "out/table-1.csv").read_text()


def test_a_section_writes_its_files(monkeypatch, tmp_path):
    monkeypatch.setattr("benchmarks.pages.ROOT", tmp_path)
    (tmp_path / "page.md").write_text("\n".join(["before", *marks("limit"), "after"]))
    Section(["text"], "page.md", {"a.csv": "1", "b.png": b"2"}).write("limit")
    assert "-->\n\ntext\n\n<!--" in (tmp_path / "page.md").read_text()
    assert (tmp_path / "a.csv").read_text() + (tmp_path / "b.png").read_text() == "12"
