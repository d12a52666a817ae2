"""The table of large surfaces is made of what fresh processes measured."""

from benchmarks.large_surfaces import in_fresh_process, line


def test_a_small_surface_fills_a_line():
    one = in_fresh_process("600", "direct-cem", "cvxopt", 2)
    assert 0 < one["factoring"] < one["seconds"]
    assert one["entries"] > one["faces"] / 2
    cells = line("600", "cvxopt", 2, [one]).split("|")
    assert [cell.strip() for cell in cells[1:5]] == ["spherical cap", str(one["faces"]), "AMD", "2"]
    assert "METIS" in line("some/lion.ply@2", "cvxopt-metis", 1, [one])
