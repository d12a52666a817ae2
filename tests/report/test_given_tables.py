"""Tables whose rows are given: their columns, captions and notes are declared."""

import pytest

from cembench.core.errors import ParameterError
from cembench.report.given_tables import _declared, given_table


@pytest.mark.parametrize("package", ["cembench.report", "cembench.validation", "cembench.sharing"])
def test_every_package_s_declarations_can_be_read(package):
    assert _declared(package)


def test_neighbouring_columns_are_repeated_together():
    rows = [["CEM", "1.50 ± 0.01", 8, "1.40 ± 0.02", 5]]
    groups = ["printed", "here"]
    table = given_table("exponents", rows, {"fewest": 3}, each={"measured": groups})
    headings = [(column.group, column.title) for column in table.columns]
    assert headings[1:] == [(group, title) for group in groups for title in ("exponent", "n")]
    assert table.notes == ("an exponent needs at least 3 sizes",)
    assert not table.columns[0].numeric
    assert (table.rows[0][2].text, table.rows[0][2].number) == ("8", 8.0)


def test_a_table_can_be_called_otherwise_and_has_the_reason_for_a_gap():
    known = {"reference": "cem", "rounds": 6}
    each = {"names": ["fdm", "ldm"]}
    rows = [["hat", 0.5, None]]
    table = given_table("speedups-alone", rows, known, called="speedups", each=each)
    assert table.name == "speedups"
    assert table.title == "Speedup of cem over the others: t / t_cem - 1"
    assert [value.text for value in table.rows[0]] == ["hat", "0.50", "-"]
    assert table.rows[0][2].why == "not timed"


def test_a_row_of_another_length_or_a_name_that_is_not_given_is_refused():
    with pytest.raises(ValueError, match="longer than argument"):
        given_table("claims-in-short", [["one"]])
    with pytest.raises(ParameterError, match="known in braces are"):
        given_table("worst-causes", [])
