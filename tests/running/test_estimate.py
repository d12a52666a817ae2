import pytest

from cembench.registry import load_registry
from cembench.running.estimate import (
    FORK_SECONDS,
    LARGE,
    estimate,
    expected_bytes,
    law_through,
)
from cembench.running.usual_costs import USUAL
from tests.records import changed, record_of


def known(faces, seconds, **cell):
    memory = {"peak_memory_bytes": 1000 * faces}
    return changed(record_of([seconds] * 6, **cell), mesh={"faces": faces}, outcome=memory)


def test_a_power_law_is_found_again():
    law = law_through([(n, 3 * n**1.5) for n in (10.0, 100.0, 700.0)])
    assert (law.factor, law.exponent) == (pytest.approx(3), pytest.approx(1.5))
    assert law_through([(100.0, 2.0)]).at(100) == pytest.approx(2)


def test_the_same_cell_counts_before_other_sizes_and_those_before_what_is_usual():
    cell = record_of([1.0], mesh_hash="big").cell
    others = [known(100, 1e-3), known(1000, 1e-2), known(1000, 9.0, solves="backslash")]
    same = estimate(cell, 10_000, [*others, known(10_000, 0.5, mesh_hash="big")])
    assert (same.basis, same.call_seconds) == ("recorded", pytest.approx(0.5))
    assert same.memory_bytes == pytest.approx(1e7)
    scaled = estimate(cell, 10_000, others)
    assert (scaled.basis, scaled.call_seconds) == ("other sizes", pytest.approx(0.1))
    unknown = record_of([1.0], algorithm="mine").cell
    rough = estimate(unknown, 1_287_579, [])
    assert rough.basis == "rough"
    assert 40 < rough.call_seconds < 400
    cem = estimate(record_of([1.0], algorithm="cem").cell, 1_287_579, [])
    assert 1.5 < cem.call_seconds < 6  # 3.1 s in the kept report
    assert rough.seconds > 6 * rough.call_seconds


def test_repeats_cost():
    few, many = (record_of([1.0], repeats=n).cell for n in (1, 10))
    more = estimate(many, 1000, []).seconds - estimate(few, 1000, []).seconds
    assert more > 9 * FORK_SECONDS


def test_an_empty_process_does_not_grow_with_the_triangles():
    cell = record_of([1.0], mesh_hash="big").cell
    tiny, middle = known(150_000, 1e-3), known(300_000, 1e-2)  # 150 MB, 300 MB
    assert estimate(cell, 60_000_000, [tiny]).memory_bytes == pytest.approx(150e6)
    assert estimate(cell, 600_000, [tiny, middle]).memory_bytes == pytest.approx(450e6)


@pytest.mark.parametrize(
    ("algorithm", "faces", "solves", "seconds"),
    [
        (
            "lscm",
            34_421,
            "reuse",
            0.091,
        ),  # the processor's time of one call, measured beside others
        ("abf++", 34_421, "reuse", 0.55),
        ("mean-value", 34_421, "reuse", 0.105),
        ("ldm", 19_966, "reuse", 0.138),
        ("qiem", 19_966, "reuse", 0.524),
        ("lscm", 34_421, "backslash", 0.081),
        ("ldm", 34_421, "backslash", 0.285),
    ],
)
def test_before_anything_is_recorded_it_is_within_a_factor_of_two(
    algorithm, faces, solves, seconds
):
    cell = record_of([1.0], algorithm=algorithm, solves=solves).cell
    assert 0.5 < estimate(cell, faces, []).call_seconds / seconds < 2


def test_every_built_in_algorithm_has_its_usual_costs():
    own = [a.name for a in load_registry().algorithms.values() if a.origin == "cembench"]
    assert set(own) <= set(USUAL)


def test_memory_is_expected_of_large_surfaces_and_known_algorithms_only():
    assert expected_bytes("direct-cem", LARGE - 1) is None
    assert expected_bytes("somebody's", 10**8) is None
    assert 5e9 < expected_bytes("direct-cem", 10_000_000) < 15e9
