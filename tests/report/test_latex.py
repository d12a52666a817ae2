import shutil
import subprocess

import pytest

from cembench.report.document import Column, Table, Value, items_of
from cembench.report.render.latex import escape, table_lines, write_latex
from tests.report.sample_report import sample_report

PDFLATEX = shutil.which("pdflatex")
needs_latex = pytest.mark.skipif(not PDFLATEX, reason="pdflatex is not installed")


def compiled(folder, name):
    command = [PDFLATEX, "-interaction=nonstopmode", "-halt-on-error", name]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace")


def test_every_character_of_text_prints_as_it_is():
    assert escape("50 % of a_b & $c #1 {x} ~ ^ \\") == (
        r"50 \% of a\_b \& \$c \#1 \{x\} \textasciitilde{} \textasciicircum{} \textbackslash{}"
    )
    assert escape("2.5ˢ ± 1°") == r"2.5\textsuperscript{s} $\pm$ 1$^\circ$"
    assert escape("Jérôme Dvořák ḍ 網") == "Jérôme Dvořák d ?"


def test_groups_stand_over_their_columns_and_footers_under_a_rule():
    columns = (Column("surface", numeric=False), Column("printed", "CEM"), Column("here", "CEM"))
    rows = (
        (Value("Foot"), Value("0.35", 0.35, "printed"), Value("0.1", 0.1, "stand-in")),
        (Value("mean"), Value("0.35", 0.35, "derived"), Value("0.1", 0.1, "derived")),
    )
    lines = table_lines(Table("t", "Title", columns, rows, footer_rows=1)).splitlines()
    assert r"\multicolumn{1}{c}{} & \multicolumn{2}{c}{CEM} \\" in lines
    assert r"\cmidrule(lr){2-3}" in lines
    assert r"Foot & 0.35 & 0.1\textsuperscript{s} \\" in lines
    assert (
        lines.index(r"mean & 0.35 & 0.1 \\")
        == lines.index(r"Foot & 0.35 & 0.1\textsuperscript{s} \\") + 2
    )


def test_a_long_table_is_continued():
    rows = tuple((Value(str(k)),) for k in range(100))
    text = table_lines(Table("long", "Long", (Column("k"),), rows))
    assert text.count(r"\begin{table}") == 3
    assert text.count(r"\label{tab:long}") == 1


def test_a_wide_table_is_continued_after_a_group_with_its_first_columns():
    groups = [(group, a) for group in ("angle", "E", "seconds") for a in "abcdefgh"]
    columns = (Column("surface", numeric=False), *(Column(a, group) for group, a in groups))
    row = (Value("Foot"), *(Value(f"{k}", k) for k in range(24)))
    text = table_lines(Table("wide", "Wide", columns, (row,), "Once."))
    rows = [line for line in text.splitlines() if line.startswith("Foot")]
    assert rows == [
        f"Foot & {' & '.join(map(str, part))} \\\\" for part in (range(16), range(16, 24))
    ]
    assert text.count("Once.") == 1
    assert text.count(r"\label{tab:wide}") == 1


def test_the_head_has_the_paper_and_links_to_claims(tmp_path):
    report = sample_report(tmp_path)
    text = write_latex(report, tmp_path).read_text()
    assert rf"\href{{{report.paper.address}}}{{doi:{report.paper.doi}}}" in text
    assert r"1 does not hold here: \hyperlink{claim:claim-2}{claim 2}; 1 holds." in text
    assert r"\hypertarget{claim:claim-2}{}" in text
    assert (
        text.index(r"\input{tables/own}") < text.index("14 of 16") < text.index(r"\tableofcontents")
    )
    assert (tmp_path / "tables" / "own.tex").is_file()


@needs_latex
def test_the_report_compiles_as_it_is(written, tmp_path):
    folder = shutil.copytree(written[1], tmp_path / "report")
    done = compiled(folder, "report.tex")
    assert done.returncode == 0, done.stdout[-2000:]


@needs_latex
def test_a_table_alone_can_be_put_into_another_document(written, tmp_path):
    shutil.copytree(written[1] / "tables", tmp_path / "tables")
    inputs = "\n".join(rf"\input{{tables/{t.name}}}\clearpage" for t in items_of(written[0], Table))
    (tmp_path / "mine.tex").write_text(
        r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage[utf8]{inputenc}"
        r"\usepackage{booktabs,graphicx}"
        rf"\begin{{document}}{inputs}\end{{document}}"
    )
    done = compiled(tmp_path, "mine.tex")
    assert done.returncode == 0, done.stdout[-2000:]
