"""The table of renumbered surfaces is made of what was measured; no figure of it is judged here."""

from benchmarks.measuring import in_fresh_process
from benchmarks.pages import Table
from benchmarks.renumbering import LAYOUT, measure, row


def test_a_process_times_both_kinds():
    seconds = in_fresh_process(measure, "600", "cem", 1, "0")
    assert seconds.keys() == {"shifts", "blocks"}
    assert min(seconds.values()) > 0


def test_ratios_are_within_processes_and_the_scatter_is_between_them():
    timed = [{"shifts": s, "blocks": 1.1 * s} for s in (0.1, 0.2, 0.1, 0.1, 0.1, 0.2, 0.3)]
    (line,) = str(Table([row("600", timed)], LAYOUT)).splitlines()[2:]
    assert line == "| 600 | 1.100 | 1.100 to 1.100 | 40.0% | 40.0% |"
