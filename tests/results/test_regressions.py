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


def found(before, after, kinds=EVERY, changes=()):
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


def test_a_cell_is_slower_if_its_verdict_holds_among_all_of_them():
    slow = Change(cell(), cell(), Comparison(1.5, (1.2, 2.0), "slower", 12, 0.001))
    maybe = Change(cell(), cell(mesh="cone"), Comparison(1.5, (1.2, 2.0), "slower", 7, 0.04))
    assert found(cell(), cell(), changes=[slow]) == [("slower", "1.50x")]
    doubtful = [maybe, *[Change(cell(), cell(), Comparison(1, (0.5, 2), "undecided", 7, 0.9))] * 3]
    assert found(cell(), cell(), changes=doubtful) == []


def test_an_unknown_kind_is_an_error_that_names_the_others():
    with pytest.raises(ParameterError, match=r"Did you mean slower\? Known: invalid, slower"):
        regressions([(cell(), cell())], [], ["slowr"])


def test_without_a_valid_map_before_nothing_can_be_said():
    with pytest.raises(RecordError, match="the earlier one has no valid map"):
        regressions([(cell(status="failed"), cell())], [], ["worse"])
