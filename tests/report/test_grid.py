"""A table on a terminal: what is broken into lines, left out or shortened, and what is marked."""

from pathlib import Path

from cembench.report.document import Column, Section, Table, Text, Value, words
from cembench.report.render.terminal import folded
from tests.terminal import printed

ROOT = Path(__file__).parents[2]
NAME = Column("surface", numeric=False)


def shown(item, width=40):
    return [line.rstrip() for line in printed(item, width).splitlines()]


def test_names_are_shortened_and_figures_stand_right():
    table = Table.of("t", "", [NAME, Column("n")], [["a-very-long-name", 1], ["b", 23]])
    assert shown(table, 12) == ["surface    n", "a-very-l…  1", "b         23"]


def test_beside_long_texts_names_are_broken_and_not_shortened():
    long = "one two three four five six seven eight"
    columns = [NAME, Column("n"), Column("said", numeric=False)]
    lines = shown(Table.of("t", "", columns, [["a-very-long-name", 1, long]]), 30)
    assert all(len(line) <= 30 for line in lines)
    assert "".join(line.split()[0] for line in lines[1:3]) == "a-very-long-name"
    assert " ".join(line[10:] for line in lines[1:]).split()[-1] == "eight"


def test_without_headings_there_is_no_line_of_them():
    assert shown(Table.of("t", "", [Column("", numeric=False)] * 2, [["a", "b"]])) == ["a  b"]


def test_where_it_is_narrow_headings_are_broken_first_and_then_details_left_out():
    columns = [NAME, Column("number of edges"), Column("more", detail=True), Column("left")]
    table = Table.of("t", "", columns, [["cap", 1, 2, 3]])
    assert shown(table, 40)[0] == "surface  number of edges  more  left"
    assert [line.split() for line in shown(table, 25)[:3]] == [
        ["number"],
        ["of"],
        ["surface", "edges", "more", "left"],
    ]
    assert shown(table, 20)[-1] == "cap          1    3"


def test_a_group_has_its_name_above_its_columns():
    columns = [NAME, Column("low", "interval"), Column("high", "interval"), Column("n", "all")]
    lines = shown(Table.of("t", "", columns, [["cap", 1.0, 2.0, 3]]))
    assert lines == [
        "         interval   all",
        "surface  low  high    n",
        "cap        1     2    3",
    ]


def test_a_surface_is_named_once_and_the_reason_for_a_gap_is_below():
    columns = [NAME, Column("x", form=".1f", lacking="not tried")]
    rows = [["cap", 1.0], ["cap", None], ["disk", Value("2.0!", 2.0, why="doubtful")]]
    table = Table.of("t", "A table", columns, rows, notes=("a note",))
    assert shown(table) == [
        *("A table", "surface     x", "cap       1.0", "            -", "disk     2.0!"),
        *("a note", "-: not tried", "doubtful"),
    ]


def test_origins_are_marked_where_they_differ():
    rows = [["cap", Value("1", 1, "stand-in")], ["disk", Value("2", 2, "surface")]]
    lines = shown(Table.of("t", "", [NAME, Column("x")], rows), 80)
    assert [line.split() for line in lines[1:3]] == [["capˢ", "1"], ["disk", "2"]]
    assert lines[3] == "ˢ measured here on a stand-in for the paper's model"
    assert shown(Table.of("t", "", [NAME, Column("x")], rows[:1]))[1:] == ["cap      1"]


def test_a_folded_table_has_the_columns_of_a_group_below_each_other():
    columns = [NAME, *(Column(t, g) for g in ("CEM", "FDM") for t in ("printed", "here"))]
    entries = [Value("1†", 1, "printed"), Value("2", 2, "model"), words("-"), words("failed")]
    lines = shown(folded(Table.of("t", "", columns, [["Foot", *entries]])))
    assert [line.split() for line in lines] == [
        ["surface", "CEM", "FDM"],
        ["Foot", "printed", "1†", "-"],
        ["here", "2ᵐ", "failed"],
    ]


def test_a_section_has_its_title_above_and_lines_between_its_tables():
    table = Table.of("t", "Table", [Column("", numeric=False)], [["a"]])
    section = Section("s", "Section", (Text("Before."), table, table))
    assert shown(section) == ["Section", "  Before.", "", "Table", "a", "", "Table", "a"]


def test_no_other_code_makes_a_table():
    making = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "cembench").rglob("*.py")
        if ".add_column(" in path.read_text()
    }
    assert making == {"cembench/report/render/terminal.py"}
