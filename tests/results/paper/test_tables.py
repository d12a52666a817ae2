import pytest

from cembench.results import paper


def test_each_table_has_twenty_models_in_one_order():
    orders = [list(paper.table(number)) for number in (1, 2, 3, 4)]
    assert len(orders[0]) == 20
    assert all(order == orders[0] for order in orders)
    assert paper.faces("Left Hand") == 105860


def test_dashes_are_none():
    assert paper.table(1)["Isis Statue"]["fdm"] is None
    assert paper.table(4)["Statue of Liberty"]["fdm_sd"] is None


@pytest.mark.parametrize("column", ["qiem", "fdm", "ldm"])
def test_table_2_follows_from_table_1_but_for_the_misprint(column):
    for model, times in paper.table(1).items():
        printed = paper.table(2)[model][column]
        if printed is None or (2, model, column) in paper.ERRATA:
            continue
        # Both times are rounded to a hundredth.
        low = (times[column] - 0.005) / (times["cem"] + 0.005) - 1
        high = (times[column] + 0.005) / (times["cem"] - 0.005) - 1
        assert low - 0.005 <= printed <= high + 0.005, (model, printed)


def test_the_misprint_is_one():
    ((number, model, column),) = paper.ERRATA
    times = paper.table(1)[model]
    assert abs(times[column] / times["cem"] - 1 - paper.table(number)[model][column]) > 0.9


def test_there_is_no_fifth_table():
    with pytest.raises(KeyError):
        paper.table(5)
