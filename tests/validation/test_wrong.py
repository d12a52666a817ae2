"""Each wrong solver is caught by the check that is meant for it."""

import functools

import pytest

from cembench.registry import load_registry
from cembench.validation.contract import examine_contract
from cembench.validation.correctness import examine_correctness
from cembench.validation.verdict import Validation, sentence
from tests.validation.in_this_process import solver_here

WRONG = "tests/validation/wrong.py"
CAUGHT_BY = {
    "parameters": "parameters",
    "real": "returns a map",
    "columns": "returns a map",
    "single": "returns a map",
    "writes": "mesh untouched",
    "boasts": "energy history",
    "miscounts": "energy history",
    "by-chance": "repeatable",
    "not-combinatorial": "combinatorial",
    "nan-sometimes": "awkward meshes",
    "crashes-without-interior": "awkward meshes",
    "mirrored": "orientation",
    "off-circle": "boundary",
    "point": "orientation",
    "fold": "folds",
    "by-number": "another numbering",
    "by-axis": "rotation, shift, scale",
    "backslash": "both linear-algebra policies",
    "noise": "E_C under refinement",
    "not-conformal": "E_C under refinement",
    "other-limit": "E_C under refinement",
}


@functools.cache
def examined(name, plugin=WRONG):
    solver = solver_here(name, plugin)
    findings = examine_contract(solver, load_registry())
    if all(finding.ok for finding in findings):
        findings += examine_correctness(solver, load_registry())
    return findings


@pytest.mark.parametrize("name", CAUGHT_BY)
def test_the_right_check_catches_it(name):
    faults = [finding for finding in examined(name) if not finding.ok]
    print([fault.name for fault in faults])
    assert faults[0].name == CAUGHT_BY[name]
    assert faults[0].measured
    assert faults[0].remedy


@pytest.mark.parametrize(
    "name",
    [
        *("lscm", "direct-cem"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("cem", "fdm", "ldm", "qiem")),
    ],
)
def test_the_built_in_conformal_maps_are_right(name):
    assert [f.measured for f in examined(name, None) if not f.ok] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        *("scp", "bff", "bff-free", "cetm", "cetm-free", "cetm-flips", "abf-linear", "abf++"),
        *("circle-packing", "angenent-haker", "gu-yau", "harmonic-tutte", "mean-value", "best"),
        *("cetm-flips-overlay", "direct-cem-holes", "best-holes"),
    ],
)
def test_the_families_of_the_field_are_right(name):
    assert [f.measured for f in examined(name, None) if not f.ok] == []


@pytest.mark.slow
def test_one_sweep_with_cem_s_own_stop_does_not_reach_the_exact_map():
    assert [f.name for f in examined("koebe-cem", None) if not f.ok] == ["exact map"]


def test_rates_are_told_and_not_judged_where_no_conformal_map_is_promised():
    by_key = {finding.name: finding for finding in examined("harmonic-circle", None)}
    assert all(finding.ok for finding in by_key.values())
    for name in ("E_C under refinement", "angle error under refinement", "modulus"):
        assert by_key[name].measured.endswith("; it does not promise a conformal map")
    # The same maps under another name promise it.
    assert not all(finding.ok for finding in examined("not-conformal"))
    validation = Validation(
        algorithm="harmonic-circle",
        title="Harmonic",
        target="disk",
        source="",
        parameters={},
        conformal=False,
        command="",
        environment="",
        findings=tuple(by_key.values()),
    )
    assert sentence(validation) == "valid; not conformal, which it does not promise"


def test_the_modulus_of_four_points_is_told_with_its_certificate():
    items = [f.measured for f in examined("right") if f.name == "modulus"]
    assert [line.split(" off by")[0] for line in items] == ["on spherical-cap", "on hemi-ellipsoid"]
    for line in items:
        off, gaps = (
            [float(x) for x in part.split(",")]
            for part in line.split(" off by ")[1].split("; reciprocal error ")
        )
        assert max(map(abs, off)) < 0.02 < gaps[2] < gaps[1] < gaps[0]


def test_a_solver_without_a_fault_has_none():
    assert all(finding.ok for finding in examined("right"))


def test_holes_that_are_no_circles_are_found_and_the_maps_laid_on_the_exact_ones():
    checks = examined("not-round")
    assert [finding.name for finding in checks if not finding.ok] == ["boundary"]
    assert sum(finding.name == "exact map" for finding in checks) == 2
