"""The limit's table is made of what was measured; no figure of it is judged here."""

import pytest

from benchmarks.limit import FLOORS, METHODS, measure, tables
from benchmarks.measuring import exponent, read_surface


@pytest.mark.parametrize("clock", ["wall", "cpu"])
def test_a_small_surface_fills_a_line(clock):
    one = measure("600", 2, clock)
    names = {*FLOORS, *METHODS}
    assert set(one["seconds"]) == set(one["ratios"]) == names
    assert one["ratios"]["limit"] == 1
    assert one["iterations"]["cem, 2 iterations"] == 2
    assert min(one["seconds"].values()) > 0
    lines = "\n".join(map(str, tables([one]))).splitlines()
    assert f"| 600 ({one['boundary']}) | {one['faces']} | " in lines[2]
    assert not any("power" in line for line in lines)


def test_the_exponent_is_that_of_the_seconds():
    items = [
        {"faces": m, "seconds": dict.fromkeys([*FLOORS, *METHODS], 1e-6 * m**1.25)}
        for m in (1000, 10_000, 300_000)
    ]
    assert exponent(items, "cem") == pytest.approx(1.25)


def test_a_surface_is_a_cap_or_a_file_split_some_times(tmp_path):
    from cembench.mesh.files import read_mesh
    from tests import gallery

    path = tmp_path / "flat.obj"
    V, F = gallery.flat_rectangle(2, 3)
    path.write_text(gallery.obj_text(V, F))
    assert read_surface(str(path)).m == read_mesh(path).m == len(F)
    assert read_surface(f"{path}@2").m == 16 * len(F)
    assert read_surface("500").m == pytest.approx(500, rel=0.3)
