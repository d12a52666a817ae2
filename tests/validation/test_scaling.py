import pytest

from cembench.core.errors import ParameterError
from cembench.validation.scaling import growth, growths, scales, sizes
from tests.validation.test_quality import record

FACES = sizes(30_000)


def power(exponent, noise=(1, 1, 1)):
    return [1e-9 * f**exponent * k for f, k in zip(FACES, noise, strict=True)]


def test_the_exponent_of_a_power_is_found():
    found = growth("ours", FACES, [power(1.25), power(1.25)])
    assert found.exponent == pytest.approx(1.25)
    assert (found.low, found.high) == (pytest.approx(1.25), pytest.approx(1.25))


def test_what_does_not_grow_hides_nothing():
    ours = growth("ours", FACES, [[0.01 + s for s in power(2.0)]])
    assert ours.exponent > 1.8
    assert not scales(ours, []).ok


def test_quadratic_growth_is_a_fault_that_names_the_exponent():
    ours = growth("ours", FACES, [power(2.0), power(2.0, (1, 1.1, 0.9))])
    finding = scales(ours, [growth("cem", FACES, [power(1.1)])])
    assert not finding.ok
    assert "(cem 1.10) from 10,000 to 30,000 triangles" in finding.measured
    assert "faces^1.9" in finding.measured or "faces^2.0" in finding.measured


def test_a_disturbed_round_is_no_fault():
    ours = growth("ours", FACES, [power(1.3), power(1.3, (1, 1, 9))])
    assert ours.high > 2
    assert scales(ours, []).ok


def test_a_solver_that_could_not_be_timed_has_no_growth():
    records = [record("ours", "a", seconds=[1.0])]
    assert growths(records, "ours", None) == []
    assert not scales(None, []).ok


def test_the_baselines_factorisation_grows_beside():
    def timed(name, faces, seconds):
        one = record(name, f"s{faces}", seconds=[seconds])
        (first,) = one.outcome.rounds
        first = first.model_copy(update={"phases": {"factorisation": seconds / 2}})
        outcome = one.outcome.model_copy(update={"rounds": (first,)})
        mesh = one.mesh.model_copy(update={"faces": faces})
        return one.model_copy(update={"outcome": outcome, "mesh": mesh})

    records = [
        timed(name, faces, seconds)
        for name in ("ours", "cem")
        for faces, seconds in zip(FACES, power(1.5), strict=True)
    ]
    found = growths(records[::-1], "ours", "cem")
    assert [growth.what for growth in found] == ["ours", "cem", "cem's factorisation"]
    assert found[2].exponent == pytest.approx(1.5)
    assert found[2].faces == FACES


def test_too_few_sizes_or_triangles_are_refused():
    with pytest.raises(ValueError, match="two sizes"):
        growth("ours", [100], [[1.0]])
    with pytest.raises(ParameterError, match="--up-to 100 is too few"):
        sizes(100)
