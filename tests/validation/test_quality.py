import pytest

from cembench.core.notices import Notice, NoticeKind
from cembench.results.records import Fault, FaultKind, Round
from cembench.validation.quality import (
    comparison_with,
    folds_on,
    quality_findings,
    sides,
    without_map,
)
from tests.records import changed, record_of


def record(algorithm, mesh, energy=0.01, seconds=(), *, target="disk", **outcome):
    metrics = {"conformal_energy": energy, "image_area": 3.14, "angle_error_mean_deg": 1.0}
    return changed(
        record_of(seconds, algorithm=algorithm, mesh=mesh, mesh_hash=mesh),
        title=algorithm.upper(),
        target=target,
        outcome={"status": "ok", "metrics": metrics} | outcome,
    )


def folded(mesh, **more):
    metrics = {"conformal_energy": 1.0, "image_area": 3.14, "flipped_triangles": 2}
    faults = (fault(FaultKind.FOLDED),)
    about = {"status": "invalid", "cause": "some reason", "faults": faults, "metrics": metrics}
    return record("ours", mesh, **(about | more))


def fault(kind):
    return Fault(kind=kind, detail="in any words")


def test_ratios_within_one_percent_are_ties():
    pair = sides([0.5, 0.98, 0.995, 1.0, 1.009, 1.02, 3.0])
    assert (pair.lower, pair.equal, pair.higher, pair.surfaces) == (2, 3, 2, 7)
    assert pair.ratio == pytest.approx(1.0)


def test_an_interval_needs_six_surfaces():
    assert sides([0.9] * 5).interval is None
    pair = sides([0.7, 0.8, 0.9, 0.95, 1.0, 1.1])
    assert (pair.interval.low, pair.interval.high) == (0.7, 1.1)
    assert sides([]).ratio is None


def test_energies_are_those_of_the_timed_maps_where_these_are_worse():
    def ours(share, **more):
        rounds = tuple(Round(calls=(1.0,), energy=share * 0.01 / 3.14) for _ in range(3))
        return record("ours", "s", rounds=rounds, **more)

    cem = record("cem", "s", 0.01)
    for share, ratio in ((1.5, 1.5), (0.5, 1.0), (1.0001, 1.0)):
        assert comparison_with([ours(share), cem], "ours", "cem").energy.ratio == pytest.approx(
            ratio
        )


def test_pairs_are_by_surface_and_only_of_valid_maps():
    records = [record("ours", f"s{k}", 0.008) for k in range(3)]
    records += [record("cem", f"s{k}", 0.01) for k in range(4)]
    records[2] = folded("s2")
    comparison = comparison_with(records, "ours", "cem")
    assert (comparison.energy.lower, comparison.energy.surfaces) == (2, 2)
    assert comparison.energy.ratio == pytest.approx(0.8)
    assert comparison.pairs[2].energy is None
    assert comparison.pairs[2].baseline_energy == 0.01
    assert comparison.speed is None


def test_energies_that_are_rounding_are_equal():
    records = [record("ours", "flat", 1e-16), record("cem", "flat", -3e-15)]
    assert comparison_with(records, "ours", "cem").energy.equal == 1


def test_energies_of_different_targets_are_divided_by_the_area():
    records = [record("ours", "s", 0.01, target="free boundary"), record("cem", "s", 0.01)]
    comparison = comparison_with(records, "ours", "cem")
    assert comparison.relative
    assert comparison.pairs[0].energy == pytest.approx(0.01 / 3.14)


def test_a_smaller_image_of_free_size_is_no_lower_energy():
    small = {"conformal_energy": 1e-6, "image_area": 3.14e-4}
    free = {"target": "free boundary"}
    records = [record("ours", "s", metrics=small, **free), record("lscm", "s", 0.01, **free)]
    assert comparison_with(records, "ours", "lscm").energy.equal == 1


def test_speed_is_judged_over_rounds_paired_on_every_surface():
    slow_rounds = [1, 1, 5, 1, 1, 1]
    records = [record("ours", name, seconds=[0.5 * t for t in slow_rounds]) for name in "ab"]
    records += [record("cem", name, seconds=slow_rounds) for name in "ab"]
    found = comparison_with(records, "ours", "cem").speed
    assert (found.ratio, found.verdict, found.rounds) == (pytest.approx(0.5), "faster", 6)
    ends = found.interval.low, found.interval.high
    assert ends == (pytest.approx(0.5), pytest.approx(0.5))


def test_folds_are_counted_and_are_no_fault():
    with_its_cause = (fault(FaultKind.FOLDED), fault(FaultKind.BOUNDARY_ORDER))
    records = [record("ours", "a"), folded("hand"), folded("foot", faults=with_its_cause)]
    assert folds_on(records) == ["hand", "foot"]
    assert quality_findings(records)[0].ok


@pytest.mark.parametrize(
    "worse",
    [
        {"faults": (fault(FaultKind.OFF_CIRCLE), fault(FaultKind.FOLDED))},
        {"faults": (fault(FaultKind.FOLDED), fault(FaultKind.MESH_CHANGED))},
        {"faults": (fault(FaultKind.OTHER_MAP), fault(FaultKind.FOLDED))},
        {"faults": (fault(FaultKind.NOT_FINITE),), "metrics": {}},
        {"faults": (fault(FaultKind.RAISED),), "status": "failed", "metrics": {}},
        {"faults": (fault(FaultKind.PROCESS_ENDED),), "status": "failed", "metrics": {}},
        {"faults": (), "cause": "2 of 8 triangles are folded (25.00%)"},
    ],
)
def test_what_is_worse_than_a_fold_is_a_fault(worse):
    records = [record("ours", "a"), folded("hand", **worse)]
    finding = quality_findings(records)[0]
    assert not finding.ok
    assert "hand" in finding.measured
    assert folds_on(records) == []


def test_a_refusal_with_a_cause_is_told_and_is_no_fault():
    gave_up = record("ours", "maze", status="failed", cause="no map", gave_up=True, metrics={})
    late = record("ours", "big", status="timeout", cause="not finished after 1 s", metrics={})
    assert without_map([record("ours", "a"), gave_up, late]) == {
        "maze": "no map",
        "big": "not finished after 1 s",
    }
    assert quality_findings([record("ours", "a"), gave_up])[0].ok
    nothing = quality_findings([gave_up])[0]
    assert not nothing.ok
    assert "no map on any of 1 surfaces" in nothing.measured


def test_other_bits_in_a_later_round_are_a_fault():
    note = Notice(NoticeKind.NOT_DETERMINISTIC, "in any words")
    finding = quality_findings([record("ours", "a", notes=(note,))])[1]
    assert not finding.ok
    assert "a" in finding.measured


def test_nothing_in_common_is_an_error():
    with pytest.raises(ValueError, match="no surface has records of both 'ours' and 'cem'"):
        comparison_with([record("ours", "a"), record("cem", "b")], "ours", "cem")


def in_gauge(algorithm, mesh, energy, gauge):
    """A record whose map has another energy in the common gauge; None: it has none there."""
    made = record(algorithm, mesh, energy)
    metrics = made.outcome.metrics | ({} if gauge is None else {"common_gauge_energy": gauge})
    return changed(made, outcome={"metrics": metrics})


def test_two_disks_are_compared_in_the_common_gauge():
    records = [in_gauge("ours", "a", 0.02, 0.01), in_gauge("cem", "a", 0.01, 0.02)]
    comparison = comparison_with(records, "ours", "cem")
    assert comparison.common_gauge
    assert comparison.energy_name == "E_C in the common gauge"
    assert comparison.energy.ratio == pytest.approx(0.5)


def test_records_without_that_gauge_are_compared_as_they_are():
    records = [in_gauge("ours", "a", 0.02, None), in_gauge("cem", "a", 0.01, 0.02)]
    comparison = comparison_with(records, "ours", "cem")
    assert not comparison.common_gauge
    assert comparison.energy_name == "E_C"
    assert comparison.energy.ratio == pytest.approx(2)
