"""The table of the allocator is made of what was measured; no figure of it is judged here."""

from benchmarks.allocator import LAYOUT, WAYS, measure, row
from benchmarks.measuring import in_fresh_process
from benchmarks.pages import Table


def test_a_process_is_timed_either_way():
    for without in WAYS.values():
        seconds = in_fresh_process(measure, "600", 2, without=without)
        assert len(seconds) == 2
        assert min(seconds) > 0


def test_the_spread_is_that_of_logarithms():
    rows = [row("600", "usual", one) for one in ([0.1, 0.1, 0.1], [0.1, 0.2, 0.4])]
    lines = str(Table(rows, LAYOUT)).splitlines()[2:]
    assert lines == [
        "| 600 | usual | 100 | 100 | 100 | 0.0% |",
        "| 600 | usual | 100 | 200 | 400 | 69.3% |",
    ]
