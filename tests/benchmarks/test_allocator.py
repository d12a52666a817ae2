"""The table of the allocator is made of what was measured; no figure of it is judged here."""

from benchmarks.allocator import process_median, told


def test_a_process_is_timed_either_way():
    for usual in (False, True):
        assert process_median("600", 2, usual=usual) > 0


def test_the_spread_is_that_of_logarithms():
    assert told([0.1, 0.1, 0.1]) == "100 | 100 | 100 | 0.0%"
    assert told([0.1, 0.2, 0.4]) == "100 | 200 | 400 | 69.3%"
