import pytest

from cembench.results.comparison import Comparison
from cembench.results.intervals import Interval
from cembench.validation.document import validation_text
from cembench.validation.finding import ValidationFinding
from cembench.validation.quality import BaselineComparison, Pair, PairedComparison, sides
from cembench.validation.verdict import Requirement, Validation, sentence, unmet
from tests.terminal import printed


def finding(name, measured, ok):
    return ValidationFinding(
        stage="correctness", name=name, ok=ok, measured=measured, allowed="x", remedy="y"
    )


def interval(low, high):
    return None if low is None else Interval(low, high)


def against(title="CEM", energy=(17, 0, 3, 0.93, 0.90, 0.96), speed=(0.55, 0.53, 0.58, "faster")):
    *counts, low, high = energy
    counts = dict(zip(("lower", "equal", "higher", "ratio"), counts, strict=True))
    comparison = PairedComparison(**counts, interval=interval(low, high))
    timed = None
    if speed:
        ratio, low, high, verdict = speed
        timed = Comparison(ratio, interval(low, high), verdict, 6)
    return BaselineComparison(
        baseline=title.lower(),
        title=title,
        relative=False,
        pairs=(),
        energy=comparison,
        angle=comparison,
        speed=timed,
    )


def validation(**parts):
    facts = dict.fromkeys(("algorithm", "title", "target", "source", "command", "environment"), "a")
    return Validation(**(facts | {"parameters": {}, "findings": ()} | parts))


def test_a_reviewer_can_read_it_aloud():
    assert sentence(validation(against=(against(),), folds_on=("hand",))) == (
        "valid; E_C lower than CEM on 17 of 20 surfaces (median ratio 0.93); 1.8 times faster; "
        "folds on 1 surface: hand"
    )


def test_worse_slower_and_without_a_map():
    worse = against(energy=(1, 1, 2, 1.2, None, None), speed=(1.52, 1.41, 1.7, "slower"))
    assert sentence(validation(against=(worse,), no_map_on={"maze": "no"})) == (
        "valid; E_C higher than CEM on 2 of 4 surfaces, equal within 1 % on 1, lower on 1 (median "
        "ratio 1.20); 1.5 times slower; no map of 1 surface: maze"
    )


def test_a_small_gain_is_not_called_one_point_zero():
    quick = against(speed=(0.978, 0.93, 0.998, "faster"))
    assert "1.02 times faster" in sentence(validation(against=(quick,)))


def test_equal_and_undecided():
    same = against(energy=(0, 6, 0, 1.0, 0.998, 1.001), speed=(1.01, 0.97, 1.05, "undecided"))
    assert sentence(validation(against=(same,))) == (
        "valid; E_C equal to CEM's within 1 % on all 6 surfaces (median ratio 1.00); neither "
        "faster nor slower than CEM for sure"
    )


@pytest.mark.parametrize("speed", [None, (0.55, 0.53, 0.58, "faster")])
def test_beside_a_speed_stands_what_is_not_detected(speed):
    shown = printed(validation_text(validation(against=(against(speed=speed),))))
    assert ("written to deceive" in shown) == (speed is not None)


def test_several_baselines_are_named():
    said = sentence(
        validation(against=(against(), against("FDM", speed=(2, None, None, "too few rounds"))))
    )
    assert "1.8 times faster than CEM" in said
    assert "2.00 times FDM's seconds, too few rounds for a verdict" in said


def test_nothing_to_compare_is_said():
    none = against(energy=(0, 0, 0, None, None, None), speed=None)
    assert sentence(validation(against=(none,))) == (
        "valid; E_C not compared with CEM: no surface that both map"
    )


def test_the_first_fault_is_told_with_its_figure_and_the_others_by_name():
    found = (
        finding("orientation", "kept", True),
        finding("folds", "3 of 9 triangles folded on cap", False),
        finding("E_C under refinement", "order 0.1", False),
        finding("E_C under refinement", "order 0.2", False),
    )
    one = validation(findings=found)
    assert sentence(one) == (
        "invalid: folds: 3 of 9 triangles folded on cap; also: E_C under refinement"
    )
    assert not one.valid
    assert not one.passed


GOOD, EVEN = against(), against(energy=(3, 3, 3, 1.0, 0.9, 1.1), speed=(1, 0.9, 1.1, "undecided"))
BAD = against(energy=(0, 0, 9, 1.5, 1.2, 1.9), speed=(2, 1.9, 2.1, "slower"))


@pytest.mark.parametrize(
    ("asked", "met"),
    [
        (Requirement.faster, [GOOD]),
        (Requirement.not_slower, [GOOD, EVEN]),
        (Requirement.better, [GOOD]),
        (Requirement.not_worse, [GOOD, EVEN]),
    ],
)
def test_requirements(asked, met):
    for one in (GOOD, EVEN, BAD):
        assert (unmet([asked], validation(against=(one,))) == ()) == (one in met)
    assert unmet([asked, asked], validation(against=(GOOD, BAD))) == (asked,)
    assert unmet([asked], validation()) == (asked,)


@pytest.mark.parametrize("asked", [one for one in Requirement if one is not Requirement.no_folds])
def test_a_requirement_is_not_met_where_the_baseline_alone_has_a_map(asked):
    pair = dict.fromkeys(Pair.model_fields) | {"surface": "cone", "faces": 9, "records": ("a", "b")}
    for ours, theirs, met in [(None, 0.1, False), (0.1, None, True), (None, None, True)]:
        pairs = (Pair(**pair | {"energy": ours, "baseline_energy": theirs}),)
        one = validation(against=(GOOD.model_copy(update={"pairs": pairs}),))
        assert (unmet([asked], one) == ()) is met


def test_a_requirement_that_is_not_met_is_told():
    assert unmet([Requirement.no_folds], validation()) == ()
    one = validation(
        folds_on=("hand",), unmet=unmet([Requirement.no_folds], validation(folds_on=("hand",)))
    )
    assert sentence(one) == "valid; folds on 1 surface: hand; required and not met: no-folds"
    assert one.valid
    assert not one.passed


def test_a_map_that_does_not_converge_is_called_not_conformal_with_what_to_declare():
    slow = finding("E_C under refinement", "on cap 0.1, 0.09: order 0.71", False)
    slow = slow.model_copy(update={"surface": "cap", "orders": (0.71, 1.5)})
    assert sentence(validation(findings=(slow, slow))) == (
        "invalid: not conformal. Its E_C does not vanish under refinement (order 0.71 on cap; a "
        "conformal map has 1.5 or more). If that is intended, declare conformal=False"
    )


def test_angle_errors_that_are_rounding_count_as_equal():
    pair = Pair(
        surface="sheet", faces=100, energy=0.0, baseline_energy=0.0,
        angle=4e-13, baseline_angle=2e-13, seconds=1.0, baseline_seconds=1.0,
        speed=None, records=("a", "b"),
    )  # fmt: skip
    assert pair.angle_ratio == 1
    assert sides([pair.angle_ratio]).equal == 1
