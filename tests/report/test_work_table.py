"""The companion of Table 1: factorisations and solves, counted."""

import pytest

from cembench.report.content.evidence import Evidence
from cembench.report.content.policies import work_tables
from cembench.results.records import LinearAlgebraWork
from tests.records import changed

#: Factorisations, right-hand sides and numbers in the factor.
COUNTS = {"cem": (1, 10.0, 2_000_000), "qiem": (8, 30.0, 2_000_000), "ldm": (2, 5.0, 0)}


@pytest.fixture
def counted(evidence):
    """The small run with counts for three algorithms on all surfaces but the flat disk."""

    def with_work(record):
        counts = COUNTS.get(record.cell.algorithm)
        if counts is None or not record.mesh.paper_row:
            return record
        numeric, solved, entries = counts
        work = LinearAlgebraWork(
            symbolic=1, numeric=numeric, right_hand_sides=solved, entries=entries
        )
        return changed(record, outcome={"work": work})

    return Evidence(evidence.store, tuple(map(with_work, evidence.records)), ())


def test_counts_stand_by_surface_and_ratios_to_cem_below(counted):
    table = next(t for t in work_tables(counted) if t.name == "linear-algebra-work-reuse")
    place = {(c.group, c.title): k for k, c in enumerate(table.columns)}
    rows = {row[0].text: row for row in table.rows}
    assert rows["Liu's Neutral Face"][place["QIEM", "factored"]].number == 8
    assert rows["Liu's Neutral Face"][place["QIEM", "factor, M"]].number == 2
    assert (
        rows["Liu's Neutral Face"][place["LDM", "factor, M"]].why
        == "the library does not report it"
    )
    assert rows["flat-disk"][place["CEM", "factored"]].why == "not counted"
    mean, count = table.rows[-2:]
    assert [mean[place["QIEM", title]].number for title in ("factored", "solved")] == [
        pytest.approx(8),
        pytest.approx(3),
    ]
    assert mean[place["LDM", "solved"]].number == pytest.approx(0.5)
    assert mean[place["LSCM", "factored"]].why == "nothing to compare"
    assert count[place["CEM", "factored"]].number == 2
    assert table.footer_rows == 2


def test_there_is_no_table_where_nothing_was_counted(evidence):
    assert work_tables(evidence) == []


def only_reuse(counted):
    kept = tuple(r for r in counted.records if r.cell.solves == "reuse")
    return Evidence(counted.store, kept, ())


def with_cem_under_backslash(counted):
    """The counted run, and CEM's cells once more under backslash: twice the work and the time."""

    def anew(record):
        work = record.outcome.work.model_copy(update={"numeric": 5, "right_hand_sides": 40.0})
        slower = {"calls": [tuple(2 * s for s in r.calls) for r in record.outcome.rounds]}
        return changed(record, slower, cell={"solves": "backslash"}, outcome={"work": work})

    records = only_reuse(counted).records
    more = [anew(r) for r in records if r.cell.algorithm == "cem" and r.outcome.work]
    return Evidence(counted.store, (*records, *more), ())


def test_one_sentence_tells_how_much_of_the_lead_is_cems_own_order_of_work(counted):
    note = work_tables(with_cem_under_backslash(counted))[0].notes[0]
    assert "leaves it 25 % of the right-hand sides" in note
    assert "reuse 20 % of the factorisations" in note
    assert "take 50 % of the seconds" in note
    assert "n = 2" in note


def test_a_run_with_one_policy_says_that_it_cannot_tell(counted):
    note, qiem, *_ = work_tables(only_reuse(counted))[0].notes
    assert "only a run with both policies tells: --solves reuse,backslash" in note
    assert "this suite decides" in qiem
