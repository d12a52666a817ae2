"""Each wrong solver is caught by the check that is meant for it."""

import gc

import pytest

from cembench.registry import load_registry
from cembench.validation.contract import examine_contract
from cembench.validation.correctness import examine_correctness
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
    "nan-sometimes": "awkward meshes",
    "crashes-without-interior": "awkward meshes",
    "mirrored": "orientation",
    "off-circle": "boundary",
    "fold": "folds",
    "by-number": "another numbering",
    "by-axis": "rotation, shift, scale",
    "backslash": "both linear-algebra policies",
    "noise": "E_C under refinement",
    "not-conformal": "E_C under refinement",
    "other-limit": "E_C under refinement",
}


@pytest.fixture(scope="module", autouse=True)
def without_old_objects():
    """What is loaded already need not be looked at by the collection before each measured call."""
    gc.freeze()
    yield
    gc.unfreeze()


def examined(name, plugin=WRONG):
    solver = solver_here(name, plugin)
    findings = examine_contract(solver, load_registry())
    if all(finding.ok for finding in findings):
        findings += examine_correctness(solver, load_registry())
    return findings


@pytest.mark.parametrize("name", CAUGHT_BY)
def test_the_right_check_catches_it(name):
    faults = [finding.name for finding in examined(name) if not finding.ok]
    print(faults)
    assert faults[0] == CAUGHT_BY[name]


@pytest.mark.parametrize("name", ["cem", "fdm", "ldm", "qiem", "lscm"])
def test_the_built_in_conformal_maps_are_right(name):
    assert [f.measured for f in examined(name, None) if not f.ok] == []
