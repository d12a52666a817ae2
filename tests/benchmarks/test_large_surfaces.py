"""The table of large surfaces is made of what fresh processes measured."""

from benchmarks.large_surfaces import LAYOUT, measure, row
from benchmarks.measuring import in_fresh_process
from benchmarks.pages import Table


def test_a_small_surface_fills_a_line():
    one = in_fresh_process(measure, "600", "cvxopt", "direct-cem")
    assert 0 < one["factoring"] < one["seconds"]
    assert one["million_entries"] * 1e6 > one["faces"] / 2
    rows = [row("600", "cvxopt", [one]), row("some/lion.ply@2", "cvxopt-metis", [one])]
    cap, lion = str(Table(rows, LAYOUT)).splitlines()[2:]
    assert cap.startswith(f"| spherical cap | {one['faces']} | AMD |")
    assert lion.startswith(f"| lion.ply@2 | {one['faces']} | METIS |")
