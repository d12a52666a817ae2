"""What the head of a report says of a run."""

from dataclasses import replace

import pytest

from cembench.report.content.as_good import as_good
from cembench.report.content.claims.efficiency import (
    always_faster,
    average_rates,
    average_savings,
    more_than_80_percent,
    table_2_follows,
)
from cembench.report.content.evidence import Evidence
from cembench.report.content.figures.performance_profile import shown_series
from cembench.report.content.findings import findings
from tests.report.small_run import write_run


@pytest.mark.parametrize(
    ("angles", "best", "good"),
    [
        ([1.2], [1.0], True),
        ([1.3], [1.0], False),
        ([0.2], [0.01], True),  # ten times, but of next to nothing
        ([1.0, 2.0], [1.0, 1.0], False),
        ([], [], True),
    ],
)
def test_maps_are_as_good_by_share_or_by_degrees(angles, best, good):
    assert as_good(angles, best) is good


def without(evidence, dropped):
    kept = tuple(record for record in evidence.records if not dropped(record))
    return Evidence(evidence.store, kept, evidence.exhibits)


def test_the_fastest_is_named_among_maps_as_good_with_an_interval(evidence):
    on_one = without(evidence, lambda r: r.mesh.paper_row != "Liu's Neutral Face")
    found = findings(on_one, {}, [])
    assert found.sentence.startswith("On one surface, of ")
    times, angles, ended = found.figures
    # Invented seconds are equal in all rounds: the interval is the figure itself.
    interval = times.words.rpartition("95 % interval ")[2]
    low, high = (float(number) for number in interval.split(" to "))
    assert times.number == f"{low:.2f} times"
    assert low == high > 1
    assert angles.number.endswith("°")
    assert ended.number == f"{len(on_one.records)} of {len(on_one.records)}"


def test_of_few_rounds_no_winner_is_named(evidence):
    def first_round(record):
        outcome = replace_rounds(record.outcome)
        return record.model_copy(update={"outcome": outcome})

    def replace_rounds(outcome):
        return outcome.model_copy(update={"rounds": outcome.rounds[:1]})

    on_one = without(evidence, lambda r: r.mesh.paper_row != "Liu's Neutral Face")
    few = replace(on_one, records=tuple(map(first_round, on_one.records)))
    found = findings(few, {}, [])
    assert "these rounds do not show which of the two" in found.sentence
    assert "1 round: too few for an interval" in found.figures[0].words
    timed = (always_faster, average_rates, average_savings, more_than_80_percent)
    tested = [claim(few, {}) for claim in (*timed, table_2_follows)]
    verdicts = [claim.verdict for claim in tested]
    assert verdicts[:4] == ["too few rounds"] * 4
    assert verdicts[4] != "too few rounds"  # of the printed tables alone
    assert "4 have too few rounds" in findings(few, {}, tested).figures[-1].words


def test_a_run_in_which_nothing_ended_ok_has_no_findings(evidence):
    failed = without(evidence, lambda r: r.outcome.status == "ok")
    assert findings(failed, {}, []) is None


def test_variants_tried_on_fewer_surfaces_are_left_out_of_a_profile(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    ours = [r for r in store.records() if r.cell.algorithm == "cem"]
    (one,) = [r for r in ours if r.mesh.paper_row == "Chinese Vase"]
    cell = one.cell.model_copy(update={"parameters": {"max_iterations": 3}})
    evidence = Evidence.of(store.folder)
    more = replace(evidence, records=(*evidence.records, one.model_copy(update={"cell": cell})))
    assert len(more.disk_series) == len(evidence.disk_series) + 1
    assert {s.label for s in shown_series(more, "reuse")} == {s.label for s in evidence.disk_series}


def test_the_head_says_how_many_times_are_unstable(evidence):
    timed = sum(bool(record.outcome.rounds) for record in evidence.records)
    assert f" of {timed} times " in findings(evidence, {}, []).sentence
    assert (
        " unstable (95 % interval wider than 10% of the figure)"
        in findings(evidence, {}, []).sentence
    )
