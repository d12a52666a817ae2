"""What became worse from one run or version to another."""

import pytest

from cembench.core.errors import ParameterError, RecordError
from cembench.results.comparison import Comparison
from cembench.results.regressions import regressions
from cembench.results.runs_compared import Change

EVERY = ("slower", "worse", "invalid")


def cell(**more):
    about = {"algorithm": "a", "mesh": "hat", "status": "ok", "target": "disk", "cause": None}
    figures = {"conformal_energy": 0.1, "angle_error_mean_deg": 2.0, "flipped_triangles": 0}
    return about | figures | more


UNDECIDED = Change(cell(), cell(), Comparison(1, (0.5, 2), "undecided", 7, 0.9))


def found(before, after, kinds=EVERY, changes=(UNDECIDED,)):
    return [(one.kind, one.detail) for one in regressions([(before, after)], changes, kinds)]


def test_equal_cells_and_better_ones_are_no_regressions():
    better = cell(conformal_energy=0.05, angle_error_mean_deg=1.0)
    assert found(cell(), cell()) == found(cell(), better) == []


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ({}, {"conformal_energy": 0.2}, "E_C 0.1 -> 0.2"),
        ({}, {"angle_error_mean_deg": 2.5}, "mean angle error 2 -> 2.5"),
        ({}, {"flipped_triangles": 1}, "folds 0 -> 1"),
        ({}, {"conformal_energy": 0.1005, "angle_error_mean_deg": 2.01}, None),
        ({"angle_error_mean_deg": 1e-9}, {"angle_error_mean_deg": 1e-6}, None),
        # The common gauge is compared where both maps have an energy in it.
        ({"common_gauge_energy": 0.1}, {"common_gauge_energy": 0.3}, "E_C 0.1 -> 0.3"),
        (
            {"target": "free boundary", "image_area": 1.0},
            {"target": "free boundary", "image_area": 2.0, "conformal_energy": 0.2},
            None,
        ),
    ],
)
def test_a_worse_map_is_named_with_its_figure(before, after, said):
    assert found(cell(**before), cell(**after)) == ([("worse", said)] if said else [])


def test_a_map_that_is_no_longer_valid_is_invalid_and_nothing_else():
    failed = cell(status="invalid", cause="3 triangles are folded", flipped_triangles=3)
    assert found(cell(), failed) == [("invalid", "invalid: 3 triangles are folded")]
    assert found(cell(), failed, ("slower", "worse")) == []


def test_seconds_that_can_no_longer_be_compared_do_not_pass():
    hidden = cell(status="not_comparable", cause="it used 2 cores", angle_error_mean_deg=3.0)
    said = "not_comparable: it used 2 cores"
    worse = ("worse", "mean angle error 2 -> 3")
    assert found(cell(), hidden) == [("invalid", said), worse]
    assert found(cell(), hidden, ["invalid"]) == [("invalid", said)]
    assert found(cell(), hidden, ["slower"]) == [("slower", said)]
    assert found(cell(), hidden, ["worse"]) == [worse]
    assert found(hidden, cell(status="failed"), ["invalid"]) == [("invalid", "failed")]
    assert found(hidden, hidden, ["worse", "invalid"]) == []


@pytest.mark.parametrize(
    "changes", [[], [Change(cell(), cell(), Comparison(1.5, None, "too few rounds", 2))]]
)
def test_slower_is_not_denied_where_it_cannot_be_decided(changes):
    with pytest.raises(RecordError, match=r"whether it is slower is unknown.*--rounds 12"):
        found(cell(), cell(), changes=changes)
    assert found(cell(), cell(), ["worse", "invalid"], changes) == []
    assert found(cell(), cell(status="failed"), changes=changes) == [("invalid", "failed")]


def test_a_cell_is_slower_if_its_verdict_holds_among_all_of_them():
    slow = Change(cell(), cell(), Comparison(1.5, (1.2, 2.0), "slower", 12, 0.001))
    maybe = Change(cell(), cell(mesh="cone"), Comparison(1.5, (1.2, 2.0), "slower", 7, 0.04))
    assert found(cell(), cell(), changes=[slow]) == [("slower", "1.50x")]
    doubtful = [maybe, *[UNDECIDED] * 3]
    assert found(cell(), cell(), changes=doubtful) == []


def test_an_unknown_kind_is_an_error_that_names_the_others():
    with pytest.raises(ParameterError, match=r"Did you mean slower\? Known: invalid, slower"):
        regressions([(cell(), cell())], [], ["slowr"])


def test_without_a_valid_map_before_nothing_can_be_said():
    with pytest.raises(RecordError, match="the earlier one has no valid map"):
        regressions([(cell(status="failed"), cell())], [], ["worse"])
