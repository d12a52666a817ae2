"""Tables that are declared in a file, and what is said of wrong declarations."""

import pickle
from dataclasses import fields

import pytest

from cembench.core.errors import ParameterError
from cembench.report.declared import declared_table, own_tables
from cembench.report.declared_plots import further
from cembench.report.document import Table, Text
from cembench.report.write_report import write_report
from cembench.results.columns import COLUMNS, row
from cembench.results.frame import evaluate

MINE = """
[by-target]
title = "Angle errors by algorithm, {policy}"
rows = "algorithm"
where = "target == 'disk'"
columns = [
  { title = "maps", value = "count(ok)", form = "d" },
  { title = "worst", value = "largest(angle_error_mean_deg)", form = ".1f", \
record = "at_largest(angle_error_mean_deg, key)" },
]

[slow]
title = "Slow maps"
where = "seconds > 2.5"
columns = ["surface", "algorithm", "seconds", { column = "iterations", title = "steps" }]

[none]
title = "Impossible maps"
where = "seconds < 0"
columns = ["surface"]
"""


@pytest.fixture
def mine(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    return file


def test_a_table_from_outside_is_a_few_lines(evidence, mine):
    ((_, items),) = further(evidence, [mine])
    by_target, slow, none = items
    assert by_target.title == "Angle errors by algorithm, reuse"
    assert [column.title for column in by_target.columns] == ["algorithm", "maps", "worst"]
    maps = {row[0].text: row[1].number for row in by_target.rows}
    assert maps == {"QIEM": 2, "FDM": 2, "LDM": 2, "CEM": 3, "Harmonic": 3}
    cem = next(row for row in by_target.rows if row[0].text == "CEM")
    worst = evidence.by_key[cem[2].record].outcome.metrics["angle_error_mean_deg"]
    assert cem[2].number == worst
    assert {row[1].text for row in slow.rows} == {"QIEM", "FDM", "LSCM"}
    assert [column.title for column in slow.columns][-1] == "steps"
    assert none == Text("Impossible maps: no record of this run is in this table.")


def test_the_report_has_it_in_all_forms(small_run, mine, tmp_path, quick_drawing):
    folder = tmp_path / "report"
    report = write_report(small_run, folder, "cembench report run", tables=[mine])
    assert report.sections[-1].title == "Tables of mine.toml"
    for form in ("csv", "tex"):
        assert (folder / "tables" / f"declared-1-slow.{form}").is_file()
    assert "Slow maps" in (folder / "index.html").read_text()
    assert "Slow maps" in (folder / "report.md").read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[a", "is not TOML"),
        ("a = 3", "mine.toml, a: "),
        ('[a]\ntitle = "A"\ncolumns = ["sekonds"]', "no column 'sekonds'; known: surface"),
        ('[a]\ntitle = "A"\ncolumns = []', "a / columns: Tuple should have at least 1 item"),
        (
            '[a]\ntitle = "A"\nrows = "algorithm"\ncolumns = [{ title = "m", value = "seconds" }]',
            "mine.toml, a: 'seconds' has a value for each record; take one, e.g. median(seconds)",
        ),
        (
            '[a]\ntitle = "A"\ncolumns = ["mesh"]\ncolour = 1',
            "a: 'colour' is not known here; allowed are title, ",
        ),
        (
            '[a]\ntitle = "A"\nrows = "algorithm"\ncolumns = ["seconds"]',
            "takes expressions (value)",
        ),
        ('[a]\ntitle = "A"\ncolumns = [{ title = "b" }]', 'either "column" or "value"'),
    ],
)
def test_a_wrong_declaration_says_where_and_what_is_allowed(evidence, tmp_path, text, said):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(ParameterError) as caught:
        further(evidence, [file])
    assert said in str(caught.value)


def test_a_file_that_is_not_there_is_an_error_before_anything_is_written(small_run, tmp_path):
    with pytest.raises(ParameterError, match="cannot be read"):
        write_report(small_run, tmp_path / "report", "x", tables=[tmp_path / "no.toml"])
    assert not (tmp_path / "report").exists()


def test_a_column_of_texts_needs_no_mark(evidence, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('[a]\ntitle = "A"\ncolumns = ["mesh", "seconds"]')
    ((_, (table,)),) = further(evidence, [file])
    assert {row[0].text for row in table.rows} == set(evidence.frame["mesh"])


@pytest.mark.parametrize("text", ["{colour}", "{", "{0}"])
def test_braces_that_stand_for_nothing_are_an_error(evidence, tmp_path, text):
    file = tmp_path / "mine.toml"
    file.write_text(f'[a]\ntitle = "{text}"\ncolumns = ["mesh"]')
    with pytest.raises(ParameterError) as caught:
        further(evidence, [file])
    assert "known in braces are in_policy, n, once, policy, reference, surfaces" in str(
        caught.value
    )


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("seconds >", "is no expression"),
        ("sekonds > 1", "names 'sekonds', which is not known. Did you mean seconds"),
        ("__import__('os')", "names '__import__'"),
        ("seconds.to_csv('x')", "asks for 'to_csv'; allowed are"),
        ("seconds.__class__", "asks for '__class__'"),
        ("[s for s in seconds]", "more than an expression"),
        ("first(mesh) + 1", "fails on this run"),
    ],
)
def test_an_expression_reads_columns_and_does_nothing_else(evidence, expression, said):
    with pytest.raises(ParameterError) as caught:
        evaluate(expression, evidence.frame)
    assert said in str(caught.value)


def test_every_column_of_a_row_is_declared_and_the_frame_has_them_all(evidence):
    for record in evidence.records:
        assert set(row(record)) <= set(COLUMNS)
    assert set(COLUMNS) <= set(evidence.frame)
    assert len(evidence.frame) == len(evidence.records)


def test_a_run_is_sent_to_other_processes_without_what_was_computed(evidence):
    assert len(evidence.frame)
    sent = pickle.loads(pickle.dumps(evidence))
    assert sent.records == evidence.records
    assert "frame" in vars(evidence)
    assert set(vars(sent)) == {one.name for one in fields(evidence)}


@pytest.mark.parametrize("name", sorted(own_tables()))
def test_entries_are_of_records_or_derived_from_them(evidence, name):
    table = declared_table(evidence, name, surface="A surface", faces="9", target="disk")
    assert isinstance(table, Table)
    for line in table.rows:
        for column, value in zip(table.columns, line, strict=True):
            assert value.number is None or value.origin or column.title == "faces"
            if value.record:
                assert value.record in evidence.by_key


def test_a_table_of_surfaces_has_a_column_for_each_algorithm_and_aggregates_below(
    evidence, tmp_path
):
    file = tmp_path / "mine.toml"
    file.write_text(
        '[a]\ntitle = "A, {surfaces}"\nrows = "surface"\nwhere = "main"\n'
        'columns = [{ column = "seconds", group = "s", title = "{algorithm}" }]\n'
        'footers = [{ label = "largest", value = "largest(x)", titles = ["CEM"] }]'
    )
    ((_, (table,)),) = further(evidence, [file])
    labels = [series.label for series in evidence.series if series.main]
    assert table.title == f"A, {len(evidence.surfaces)}"
    assert [(c.group, c.title) for c in table.columns[2:]] == [("s", label) for label in labels]
    column = 2 + labels.index("CEM")
    *rows, largest, counts = table.rows
    known = [row[column].number for row in rows if row[column].number is not None]
    assert largest[column].number == max(known)
    assert counts[column].number == len(known)
