"""The one table of the terminal: what is shortened, what wraps, and that nothing else makes one."""

import io
from pathlib import Path

from rich.console import Console

from cembench.report.render.grid import figures, grid, names, words

ROOT = Path(__file__).parents[2]


def shown(table, width=40):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(table)
    return console.export_text().splitlines()


def test_names_are_shortened_figures_stand_right_and_words_wrap():
    rows = [["a-very-long-name", "1", "one two three four five six seven"], ["b", "23", "x"]]
    table = grid([names("surface", 8), *figures("n"), *words("said")], rows)
    head, first, *rest = shown(table, 30)
    assert head.split() == ["surface", "n", "said"]
    assert first.startswith("a-very-…  1 one two")
    assert rest[-1].startswith("b        23 x")
    assert all(len(line) <= 30 for line in [head, first, *rest])


def test_without_headings_there_is_no_line_of_them():
    assert len(shown(grid([names(""), names("")], [["a", "b"]]))) == 1


def test_no_other_code_makes_a_table():
    making = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "cembench").rglob("*.py")
        if ".add_column(" in path.read_text()
    }
    assert making == {"cembench/report/render/grid.py"}
