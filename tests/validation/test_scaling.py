from math import inf, log

import numpy as np
import pytest

from benchmarks import noise
from benchmarks.growth import simulate
from cembench.core.errors import ParameterError
from cembench.validation.scaling import (
    MAX_ROUNDS,
    answer_of,
    growth_of,
    largest_two,
    more_rounds,
    scales,
    seconds_a_round,
    sizes,
)
from tests.records import changed
from tests.validation.test_quality import record

FACES = sizes(30_000)
EVEN = [1.0] * 7


def timed(name, faces, walls, cpus=None, phase=0.5):
    """A record of these seconds, one a round."""
    each = {"phases": [{"factorisation": phase * s} for s in walls], "cpu_seconds": cpus or walls}
    return changed(record(name, f"s{faces}", seconds=walls), each, mesh={"faces": faces})


def power(name, exponent, slower=EVEN, cpu=True):
    """One sitting of a solver; the largest mesh is slower by so much in each round."""
    records = []
    for faces in FACES:
        seconds = [1e-9 * faces**exponent * (k if faces == FACES[-1] else 1.0) for k in slower]
        records.append(timed(name, faces, seconds, seconds if cpu else [0.0] * len(seconds)))
    return records


def found(ours, reference=None, **more):
    sitting = power("ours", ours, **more)
    if reference is not None:
        sitting += power("cem", reference, **more)
    return growth_of([sitting[::-1]], "ours", None if reference is None else "cem")


def test_the_exponent_of_a_power_is_found_with_its_interval():
    one = found(1.25, 1.0, slower=[1.0, 1.02, 0.98, 1.01, 0.99, 1.03, 0.97])
    assert one.ours.exponent == pytest.approx(1.25)
    assert one.ours.interval.low == pytest.approx(1.25 + log(0.97) / log(3), abs=1e-3)
    assert one.ours.interval.high == pytest.approx(1.25 + log(1.03) / log(3), abs=1e-3)
    assert (one.above, one.above_interval.low) == pytest.approx((0.25, 0.25))
    assert (one.answer, one.ours.rounds) == ("fine", 7)


def test_quadratic_growth_is_a_fault_that_names_the_exponent():
    finding = scales(found(2.0, 1.0))
    assert not finding.ok
    assert finding.measured == (
        "seconds grow like faces^2.00 (2.00 to 2.00) from 10,000 to 30,000 triangles, "
        "1.00 (1.00 to 1.00) above cem 1.00"
    )
    assert not scales(found(2.0)).ok


def test_what_does_not_grow_hides_nothing():
    records = power("ours", 2.0)
    slow = [timed("ours", r.mesh.faces, [0.01 + s for s in r.outcome.seconds]) for r in records]
    one = growth_of([slow], "ours", None)
    assert one.ours.exponent > 1.8
    assert one.answer == "too_steep"


def test_a_machine_on_which_large_meshes_are_dearer_is_no_fault():
    """Measured once: 1.94 where a quiet machine has 1.68; the reference felt it as well."""
    one = found(1.68, 1.0, slower=[1.33] * 7)
    assert one.ours.interval.low > 1.9
    assert one.above_interval.high < 0.7
    assert one.answer == "fine"
    assert found(1.68, slower=[1.33] * 7).answer == "too_steep"


def test_what_a_busy_machine_does_to_the_wall_clock_is_no_fault():
    busy = [1.0, 9.0, 1.0, 4.0, 2.0, 3.0, 5.0]
    steady = [timed("ours", r.mesh.faces, r.outcome.seconds) for r in power("ours", 1.3)]
    slowed = power("ours", 1.3, slower=busy)
    mixed = [
        timed("ours", wall.mesh.faces, wall.outcome.seconds, cpu.outcome.seconds)
        for wall, cpu in zip(slowed, steady, strict=True)
    ]
    one = growth_of([mixed], "ours", None)
    assert (one.clock, one.answer) == ("cpu", "fine")
    wall = growth_of([slowed], "ours", None)
    assert (wall.answer, wall.ours.interval.high > 2) == ("inconclusive", True)


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_cpu_seconds_are_not_taken_where_there_are_none_or_the_solver_waits(share):
    records = [
        timed("ours", r.mesh.faces, r.outcome.seconds, [share * s for s in r.outcome.seconds])
        for r in power("ours", 1.3)
    ]
    assert growth_of([records], "ours", None).clock == "wall"


def test_what_cannot_be_told_is_no_fault_and_is_said():
    finding = scales(found(1.75, slower=[0.8, 1.2, 0.9, 1.1, 1.0, 0.7, 1.3]))
    assert (finding.ok, finding.undecided) == (True, True)
    assert finding.measured.endswith("inconclusive (not after 7 rounds)")
    assert scales(found(2.0, slower=[1.0, 1.0])).measured.endswith("(2 rounds are too few)")


def test_rounds_of_several_sittings_are_paired_within_each():
    first, second = (
        power("ours", 1.2, s) + power("cem", 1.0, s) for s in ([1, 2], [3, 1, 4, 2, 1])
    )
    largest = [r for r in second if r.cell.mesh in largest_two(first, "ours")]
    assert len(largest) == 4
    one = growth_of([first, largest], "ours", "cem")
    assert (one.ours.rounds, one.ours.faces) == (7, FACES)
    assert (one.above_interval.low, one.above_interval.high) == pytest.approx((0.2, 0.2))
    assert one.ours.interval.high > 1.2 + log(2) / log(3)
    lost = [
        changed(r, outcome={"status": "failed"}) if r.cell.algorithm == "ours" else r
        for r in largest
    ]
    assert growth_of([first, lost], "ours", "cem") is None


def test_rounds_are_added_until_the_answer_is_clear_or_time_is_used_up():
    two, seven = (
        found(1.2, slower=[1.0, 1.0]),
        found(1.75, slower=[0.8, 1.2, 0.9, 1.1, 1, 0.7, 1.3]),
    )
    assert more_rounds(two, 0, 1.0) == 5
    assert more_rounds(seven, 0, 1.0) == 3
    assert more_rounds(seven, 59, 1.0) == 0
    assert more_rounds(two, 59, 1.0) == 5
    assert more_rounds(found(1.2), 0, 1.0) == 0
    # Slow: what looks fine is left without an interval, and what looks too steep gets one.
    assert more_rounds(two, 0, 60.0) == 0
    assert more_rounds(found(2.0, slower=[1.0, 1.0]), inf, 60.0) == 5
    last = found(1.75, slower=[0.8, 1.2] * (MAX_ROUNDS // 2))
    assert (last.answer, more_rounds(last, 0, 0.0)) == ("inconclusive", 0)
    assert seconds_a_round(power("ours", 1.0)) > 0


def test_the_references_factorisation_grows_beside():
    one = found(1.5, 1.5)
    assert [growth.what for growth in one.others] == ["cem", "cem's factorisation"]
    assert one.others[1].exponent == pytest.approx(1.5)
    assert one.others[1].seconds[0] == pytest.approx(0.5 * one.ours.seconds[0])


def test_a_solver_that_could_not_be_timed_has_no_growth():
    assert growth_of([[record("ours", "a", seconds=[1.0])]], "ours", None) is None
    assert not scales(None).ok


def test_too_few_triangles_are_refused():
    with pytest.raises(ParameterError, match="up_to=100 is too few"):
        sizes(100)


@pytest.mark.parametrize("model", noise.MODELS)
def test_growth_at_the_limit_is_called_too_steep_in_at_most_5_percent(model):
    at_limit = simulate(model, 300, ours=1.75, reference=0.7)
    assert at_limit.share("too_steep") < 0.05 + 3 * np.sqrt(0.05 / 300)
    # The solver of the guide, and one that is quadratic.
    assert simulate(model, 200, ours=1.68, reference=1.0).share("too_steep") < 0.02
    quadratic = simulate(model, 200, ours=2.0, reference=1.0)
    assert quadratic.share("fine") < 0.02
    assert quadratic.share("too_steep") > 0.5, quadratic


def test_without_noise_there_is_no_doubt():
    assert answer_of([1.7] * 7, None) == "fine"
    assert answer_of([1.9] * 7, None) == "too_steep"
    assert answer_of([1.9] * 7, [0.7] * 7) == "fine"
    assert answer_of([1.9] * 6, None) == "inconclusive"
