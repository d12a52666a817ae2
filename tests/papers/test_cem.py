import pytest

from cembench.registry import load_registry
from cembench.results.papers import find_paper

PAPER = find_paper("cem")


def test_each_table_has_twenty_models_in_one_order():
    orders = [list(PAPER.tables[number]) for number in (1, 2, 3, 4)]
    assert len(orders[0]) == 20
    assert all(order == orders[0] for order in orders)
    assert PAPER.faces("Left Hand") == 105860


def test_dashes_are_none():
    assert PAPER.tables[1]["Isis Statue"]["fdm"] is None
    assert PAPER.tables[4]["Statue of Liberty"]["fdm_sd"] is None


@pytest.mark.parametrize("column", ["qiem", "fdm", "ldm"])
def test_table_2_follows_from_table_1_but_for_the_misprint(column):
    for model, times in PAPER.tables[1].items():
        printed = PAPER.tables[2][model][column]
        if printed is None or (2, model, column) in PAPER.misprints:
            continue
        # Both times are rounded to a hundredth.
        low = (times[column] - 0.005) / (times["cem"] + 0.005) - 1
        high = (times[column] + 0.005) / (times["cem"] - 0.005) - 1
        assert low - 0.005 <= printed <= high + 0.005, (model, printed)


def test_the_misprint_is_one():
    ((number, model, column),) = PAPER.misprints
    times = PAPER.tables[1][model]
    assert abs(times[column] / times["cem"] - 1 - PAPER.tables[number][model][column]) > 0.9


def test_on_the_paper_s_own_models_fdm_is_the_public_program():
    cem, fdm = (load_registry().algorithm(name) for name in ("cem", "fdm"))
    assert fdm.arguments({})["public_program"] is False
    assert PAPER.as_printed("Foot", [cem, fdm]) == {"fdm.public_program": True}
    assert PAPER.as_printed("Foot", [cem]) == {}


def test_a_parameter_as_printed_is_undone_and_others_stay():
    usual = {"public_program": False, "tolerance": 1e-3}
    assert PAPER.as_elsewhere("fdm", {"public_program": True, "tolerance": 1e-3}) == usual
    assert PAPER.as_elsewhere("fdm", usual) == usual
    assert PAPER.as_elsewhere("cem", {"public_program": True}) == {"public_program": True}
