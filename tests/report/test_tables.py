import pytest
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.report.content.evidence import Evidence
from cembench.report.content.printed_tables import (
    READINGS,
    averages_table,
    measured_rates,
    printed_rates,
    printed_tables,
)
from cembench.report.content.surface_page import figures_table
from cembench.report.declared import declared_table
from cembench.report.document import marked
from cembench.results.columns import significant
from cembench.results.papers import find_paper
from cembench.results.records import LinearAlgebraWork
from tests.records import changed
from tests.report.small_run import ok, record, write_run

PAPER = find_paper("cem")


def by_name(tables):
    return {table.name: table for table in tables}


def entry(table, surface, group, title):
    row = next(row for row in table.rows if row[0].text == surface)
    pairs = zip(table.columns, row, strict=True)
    return next((c, v) for c, v in pairs if (c.group, c.title) == (group, title))


def test_printed_figures_stand_beside_measured_ones_each_with_its_origin(evidence):
    table = by_name(printed_tables(evidence, 1))["table-1"]
    _, printed = entry(table, "Liu's Neutral Face", "CEM", "printed")
    column, here = entry(table, "Liu's Neutral Face", "CEM", "here")
    assert (printed.text, printed.origin, printed.record) == ("2.01", "printed", "")
    assert (here.number, here.origin) == (1.0, "stand-in")
    assert marked(here, column).endswith("ˢ")
    assert evidence.rows[here.record]["algorithm"] == "cem"
    assert evidence.rows[here.record]["seconds"] == here.number


@pytest.mark.parametrize("number", [1, 3, 4])
def test_every_printed_cell_is_the_papers(evidence, number):
    table = by_name(printed_tables(evidence, number))[f"table-{number}"]
    printed = {
        v.number
        for row in table.rows
        for c, v in zip(table.columns, row, strict=True)
        if c.title == "printed"
    }
    rows = [PAPER.tables[number][m] for m in ("Chinese Vase", "Liu's Neutral Face")]
    assert printed == {v for row in rows for k, v in row.items() if k != "faces"}


def test_gaps_say_why(evidence):
    table = by_name(printed_tables(evidence, 1))["table-1"]
    _, failed = entry(table, "Chinese Vase", "QIEM", "here")
    assert (failed.text, failed.number) == ("failed", None)
    assert failed.why == "failed: it_gave up & 100 % lost"
    assert any("failed: it_gave up" in note and "Chinese Vase" in note for note in table.notes)
    assert any(note.startswith("not in this run: Nefertiti") for note in table.notes)
    other = by_name(printed_tables(evidence, 1))["table-1-other-surfaces"]
    assert entry(other, "flat-disk", "LDM", "here")[1].why == "not in this run"
    assert entry(other, "flat-disk", "FDM", "here")[1].text == "timeout"


def test_another_number_of_triangles_than_printed_is_said(evidence):
    notes = by_name(printed_tables(evidence, 3))["table-3"].notes
    assert any(n.startswith("triangles differ") and "193,298 in print" in n for n in notes)


def test_maps_to_other_targets_are_in_no_table_of_disks(evidence):
    tables = [t for number in (1, 2, 3, 4) for t in printed_tables(evidence, number)]
    assert not any("LSCM" in column.group for table in tables for column in table.columns)
    apart = declared_table(evidence, "other-targets")
    assert {row[2].text for row in apart.rows} == {"free boundary"}
    titles = [column.title for column in apart.columns]
    assert {"|mu|", "area SD", "overlap"} <= set(titles)
    done = [row for row in apart.rows if row[3].text == "ok"]
    assert done
    assert all(0 < row[titles.index("|mu|")].number < 1 for row in done)


def test_a_surface_page_compares_disks_in_a_common_gauge_and_gives_free_boundaries_none(evidence):
    surface = evidence.surfaces[0]
    table = figures_table(evidence, surface, "here")
    column = [c.title for c in table.columns].index("E_C, gauge")
    energies = {row[0].text: row[column] for row in table.rows if row[2].text == "ok"}
    assert energies["LSCM *"].text == "-"
    assert energies["LSCM *"].why == "the map does not go to the disk"
    assert energies["CEM"].number > 0


def test_a_surface_page_has_the_folds_before_the_repair(evidence):
    table = figures_table(evidence, evidence.surfaces[0], "here")
    column = [c.title for c in table.columns].index("folds before")
    assert {row[column].text for row in table.rows if row[2].text == "ok"} == {"0"}


def test_a_record_older_than_a_figure_has_a_gap_there(evidence):
    record = next(r for r in evidence.records if r.outcome.status == "ok")
    kept = dict(record.outcome.metrics)
    record.outcome.metrics = {k: v for k, v in kept.items() if k != "beltrami_area_mean"}
    try:
        surface = next(s for s in evidence.surfaces if s.mesh_hash == record.cell.mesh_hash)
        table = figures_table(evidence, surface, "here")
        column = [c.title for c in table.columns].index("|mu|")
        whys = [row[column].why for row in table.rows if row[2].text == "ok"]
        assert whys.count("not measured") == 1
    finally:
        record.outcome.metrics = kept


def test_other_algorithms_and_surfaces_have_tables_of_their_own(evidence):
    statements = by_name(printed_tables(evidence, 1))
    assert {"table-1", "table-1-other-algorithms", "table-1-other-surfaces"} <= set(statements)
    groups = {column.group for column in statements["table-1-other-algorithms"].columns}
    assert groups == {"", "Harmonic"}
    assert not any(
        column.title == "printed" for column in statements["table-1-other-surfaces"].columns
    )


def test_the_printed_averages_are_the_stated_ones_in_both_readings():
    sets = [printed_rates(PAPER, a) for a in PAPER.compared]
    assert [len(rates) for rates in sets] == [20, 18, 20]
    mean, geometric, saving, savings = READINGS
    assert [mean.entry(rates, "").text for rates in sets] == ["8.5", "17.2", "4.1"]
    assert [geometric.entry(rates, "").text for rates in sets] == ["6.8", "12.4", "3.5"]
    # The paper cuts these, 94.5 % and 80.5 % among them, instead of rounding.
    assert [int(100 * saving.of(rates)) for rates in sets] == [89, 94, 80]
    assert [savings.entry(rates, "").text for rates in sets] == ["83 %", "89 %", "73 %"]


def test_averages_of_known_rates():
    rates = [1.0, 3.0]  # CEM takes a half, and a quarter
    expected = [2, 8**0.5 - 1, 2 / 3, 5 / 8]
    assert [reading.of(rates) for reading in READINGS] == pytest.approx(expected)


def test_aggregates_run_over_what_was_measured_and_say_their_n(evidence):
    assert measured_rates(evidence, "qiem", "reuse", "stand-in") == {
        "Liu's Neutral Face": pytest.approx(7.0)
    }
    assert [*measured_rates(evidence, "ldm", "reuse", "stand-in").values()] == pytest.approx(
        [-0.5, 0.0]
    )
    table = averages_table(evidence, 2, "reuse", "stand-in")
    counts = table.rows[-1]
    assert [v.number for v in counts[1:]] == [None, 20, 1, 1, None, 18, 2, 2, None, 20, 2, 2]
    made = by_name(printed_tables(evidence, 2))
    assert [name for name in made if "averages" in name and "backslash" not in name] == [
        "averages-on-stand-ins"
    ]
    assert measured_rates(evidence, "ldm", "reuse", "model") == {}
    footer = made["table-2"].rows[-1]
    assert footer[0].text == "n, surfaces counted"
    assert [v.number for v in footer[2:]] == [2, 1, 2, 2, 2, 2]


def test_factorisations_stand_beside_the_averages_of_speedups(evidence):
    counts = {"cem": 2, "qiem": 16, "ldm": 4}

    def counted(record):
        if record.cell.algorithm not in counts:
            return record
        work = LinearAlgebraWork(
            symbolic=1, numeric=counts[record.cell.algorithm], right_hand_sides=3
        )
        return changed(record, outcome={"work": work})

    plain = averages_table(evidence, 2, "reuse", "stand-in")
    assert not any("factorisations" in row[0].text for row in plain.rows)
    known = Evidence(evidence.store, tuple(map(counted, evidence.records)), evidence.exhibits)
    table = averages_table(known, 2, "reuse", "stand-in")
    (row,) = (row for row in table.rows if "factorisations" in row[0].text)
    by_name = dict(zip([(c.group, c.title) for c in table.columns], row, strict=True))
    assert by_name["QIEM", "here"].number == pytest.approx(8)
    assert by_name["LDM", "here"].number == pytest.approx(2)
    assert by_name["FDM", "here"].number is None


def test_the_misprint_is_marked(evidence):
    from cembench.report.by_surface import paper_value

    value = paper_value(PAPER, 2, "Knit Cap Man", "fdm", 2)
    assert value.text == "29.07†"
    assert "28.07" in value.why
    dash = paper_value(PAPER, 2, "Isis Statue", "fdm", 2)
    assert (dash.number, dash.why) == (None, "Table 2 of the paper has no figure here")


def test_both_ways_of_solving_stand_side_by_side(evidence):
    table = declared_table(evidence, "reuse-against-backslash")
    row = next(r for r in table.rows if r[0].text == "Chinese Vase")
    cem = [v.number for c, v in zip(table.columns, row, strict=True) if c.group == "CEM"]
    assert cem == [1.0, 2.0, 2.0]
    rates = measured_rates(evidence, "fdm", "backslash", "stand-in").values()
    assert [*rates] == pytest.approx([0.5, 2.0])


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.0123456, "0.0123"), (0.5, "0.500"), (12.345, "12.3"), (1234.5, "1,234"), (0, "0")],
)
def test_seconds_have_three_digits_that_count(number, text):
    assert significant(number) == text


def test_a_model_counts_once_itself_before_its_stand_in(tmp_path):
    store = write_run(tmp_path, policies=("reuse",))
    model = spherical_cap(300)
    for algorithm, seconds in (("cem", 1.0), ("ldm", 8.0)):
        outcome, uv = ok(algorithm, model, seconds)
        one = record(algorithm, model, "Liu's Neutral Face", "reuse", outcome)
        one = changed(one, mesh={"origin": "model"})
        store.save(one, uv, {"id": "machine", "cpu": "x"})
    evidence = Evidence.of(tmp_path)
    assert [s.name for s in evidence.models if s not in evidence.one_per_model] == ["spherical-cap"]
    assert evidence.surface_for_model("Liu's Neutral Face").origin == "model"
    assert measured_rates(evidence, "ldm", "reuse", "model") == {
        "Liu's Neutral Face": pytest.approx(7.0)
    }
    assert len(measured_rates(evidence, "ldm", "reuse", "stand-in")) == 1
    table = by_name(printed_tables(evidence, 2))["table-2"]
    assert len(table.rows) - table.footer_rows == 3
    _, counted = entry(table, "n, surfaces counted", "LDM", "here")
    assert counted.number == 2


def test_how_sure_the_speedups_are_alone_together_and_over_families(evidence):
    tables = by_name(printed_tables(evidence, 2))
    table = tables["sure-speedups"]
    by_title = {
        (column.group, column.title): [row[k] for row in table.rows]
        for k, column in enumerate(table.columns)
    }
    names = [value.text for value in by_title["", "algorithm"]]
    assert "FDM" in names
    place = names.index("FDM")
    alone = [
        by_title["one by one", t][place].number for t in ("CEM faster", "CEM slower", "undecided")
    ]
    both = [
        by_title["together", t][place].number for t in ("CEM faster", "CEM slower", "undecided")
    ]
    surfaces = by_title["", "surfaces"][place].number
    assert sum(alone) == sum(both) == surfaces >= 2
    assert both[0] <= alone[0]
    assert by_title["over families", "sign test"][place].number == 2 * 0.5**surfaces
    assert by_title["over families", "95 % interval"][place].why == "fewer than 6 families"
    assert "Holm" in table.caption
    assert "written to deceive is not detected" in table.caption
