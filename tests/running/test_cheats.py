"""What solvers get that are faster than their work: none of them has seconds to compare."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.levers import NO_LEVERS

from cembench.core.notices import NoticeKind, of_kind
from cembench.registry import load_registry
from cembench.results.comparison import scatters
from cembench.results.records import Fault, FaultKind, not_ok
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.validation.examine import ValidationOptions, examine
from cembench.validation.quality import quality_findings
from cembench.validation.solver import Solver, load_solver
from cembench.validation.verdict import sentence
from tests.records import record_of

CHEATS = Path(__file__).with_name("cheats.py")
#: What each comes to; None: it ends ok, with the seconds of all its work.
FOUND = {
    "honest": None,
    "by-content": None,
    "late": None,
    "patched-clock": None,
    "by-triangles": FaultKind.KEPT_RESULT,
    "by-shape": FaultKind.KEPT_RESULT,
    "on-disk-by-name": FaultKind.KEPT_RESULT,
    "turned": FaultKind.KEPT_RESULT,
    "keeps-laplacian": FaultKind.KEPT_RESULT,
    "precomputed": FaultKind.KEPT_RESULT,
    "zeros-later": FaultKind.OTHER_MAP,
    "patched-ledger": FaultKind.WRONG_REPORT,
    "keeps-ordering": None,
    "second-look": FaultKind.OFF_CIRCLE,
    "no-array": FaultKind.WRONG_SHAPE,
    "own-access": FaultKind.NOT_A_PARAMETERIZATION,
    "collector": None,
    "foresight": FaultKind.WORKS_AHEAD,
    "noise": FaultKind.OTHER_MAP,
    "kept-factor": None,
    "factor-by-triangles": None,
    "pool": None,
    "sleeping-child": None,
    "sleeping-pool": None,
    "foreseen": None,
    "slow-clocks": FaultKind.IMPOSSIBLE_TIMES,
    "warmed-up": None,
}
#: Not deterministic, which `validate` refuses: `run` times all of their work.
RANDOM = ("noise-over-map", "random", "shifted")
#: Its quality is that of the worse maps.
TWO_FACED = "two-faced"
#: Found by who is running, or by CPU time.
BUSY = {
    "eight-threads": FaultKind.MORE_CORES,
    "six-processes": FaultKind.MORE_CORES,
    "orphans": FaultKind.MORE_CORES,
    "shrunk-times": FaultKind.MORE_CORES,
    "on-disk": None,
}
AHEAD = "works-ahead"
#: What a single call shows.
SINGLE = (
    *(FaultKind.OTHER_MAP, FaultKind.WRONG_REPORT, FaultKind.OFF_CIRCLE),
    *(FaultKind.WRONG_SHAPE, FaultKind.NOT_A_PARAMETERIZATION),
)


@pytest.fixture
def surface(tmp_path, monkeypatch):
    """A surface that one of the solvers knows, and a folder where others may keep maps."""
    mesh = stand_in("cowboy-hat-stand-in", 1200, levers=NO_LEVERS)
    file = tmp_path / "known.npz"
    np.savez(file, V=mesh.V, F=mesh.F)
    monkeypatch.setenv("CHEATS_SURFACE", str(file))
    monkeypatch.setenv("CHEATS_FOLDER", str(tmp_path))
    return mesh


def records(names, mesh, folder, *, repeats=2):
    registry = load_registry([str(CHEATS)])
    chosen = [registry.algorithm(name) for name in names]
    how = MeasurementSettings(repeats=repeats)
    tasks = plan_cells(chosen, [mesh], {}, how, [str(CHEATS)])
    records = run_tasks(tasks, Store(folder), Options(timeout=120))
    return {record.cell.algorithm: record for record in records}


def is_valid(record):
    """Whether `validate` finds no fault in a record of its rounds."""
    return all(finding.ok for finding in quality_findings([record]))


def assert_as_expected(found, expected):
    """Check both columns of the table: what `run` gives, and what `validate` says of that."""
    for name, record in found.items():
        outcome = record.outcome
        assert is_valid(record) == (expected[name] is None), name
        kinds = [fault.kind for fault in outcome.faults]
        if expected[name] is None:
            assert (outcome.status, outcome.cause) == ("ok", None), name
            assert outcome.median_seconds > 0
        else:
            assert expected[name] in kinds, (name, outcome.status, outcome.cause)
            assert outcome.median_seconds is None
            assert outcome.rounds == ()


def test_what_is_kept_from_call_to_call_has_no_seconds(surface, tmp_path):
    outcomes = records([*FOUND, "by-id"], surface, tmp_path / "run")
    # An id comes back when its mesh is gone, or does not: a hit is found, and a miss is honest.
    record = outcomes.pop("by-id")
    by_id = record.outcome
    assert is_valid(record) == (by_id.status == "ok")
    assert (by_id.status, [f.kind for f in by_id.faults][:1]) in (
        ("ok", []),
        ("not_comparable", [FaultKind.KEPT_RESULT]),
        ("invalid", [FaultKind.OTHER_MAP]),
    )
    assert_as_expected(outcomes, FOUND)
    outcomes = {name: record.outcome for name, record in outcomes.items()}
    # The map of the check is valid, and keeps its figures.
    assert outcomes["by-shape"].status == "not_comparable"
    assert outcomes["by-shape"].metrics["flipped_triangles"] == 0
    assert "in round 1 of 2: the second call returned" in outcomes["by-shape"].cause
    # What a map costs that is computed when it is looked at is in its time.
    assert all(r.phases["solves"] > 0 for r in outcomes["late"].rounds)
    # A cache by content is never hit: each call does the work.
    assert all(r.phases["solves"] > 0 for r in outcomes["by-content"].rounds)
    assert all(r.repeated for r in outcomes["honest"].rounds)
    # What the triangles determine is of no use for other numbers of the same vertices.
    assert all(min(r.calls) > 0.3 for r in outcomes["keeps-ordering"].rounds)
    for name in ("kept-factor", "factor-by-triangles"):
        assert all(r.phases["factorisation"] > 0.02 for r in outcomes[name].rounds)
        assert all(r.repeated for r in outcomes[name].rounds)
    # A surface that did not exist cannot be mapped before the call.
    for name in ("collector", "foreseen", "warmed-up"):
        assert all(r.phases["solves"] > 0 for r in outcomes[name].rounds)


def test_who_scatters_has_the_seconds_of_all_its_work(surface, tmp_path):
    outcomes = records(RANDOM, surface, tmp_path / "run", repeats=3)
    for record in outcomes.values():
        assert record.outcome.status == "ok", record.outcome.cause
        assert of_kind(NoticeKind.NOT_DETERMINISTIC, record.outcome.notes)
        assert scatters(record)
        assert all(r.phases["solves"] > 0 for r in record.outcome.rounds)
        assert not is_valid(record)


def test_who_makes_a_better_map_of_the_surface_than_of_moved_ones_is_told(surface, tmp_path):
    record = records([TWO_FACED], surface, tmp_path / "run", repeats=1)[TWO_FACED]
    assert record.outcome.status == "ok", record.outcome.cause
    assert record.outcome.worse_when_timed > 1.05
    assert of_kind(NoticeKind.WORSE_WHEN_TIMED, record.outcome.notes)


@pytest.mark.slow
def test_more_cores_and_changed_clocks_have_no_seconds(surface, tmp_path):
    outcomes = records(BUSY, surface, tmp_path / "run", repeats=1)
    assert_as_expected(outcomes, BUSY)
    # The second run gets other motions: what the first one left on disk is of no use.
    shutil.rmtree(tmp_path / "run")
    again = records(["on-disk"], surface, tmp_path / "run", repeats=1)["on-disk"]
    assert again.outcome.rounds[0].phases["solves"] > 0


@pytest.mark.slow
def test_what_works_on_between_calls_has_no_seconds(surface, tmp_path):
    record = records([AHEAD], surface, tmp_path / "run")[AHEAD]
    kinds = {fault.kind for fault in record.outcome.faults}
    assert kinds & {FaultKind.WORKS_AHEAD, FaultKind.MORE_CORES}
    assert not is_valid(record)


@pytest.mark.parametrize(
    "kind",
    [
        *(FaultKind.KEPT_RESULT, FaultKind.MORE_CORES, FaultKind.WORKS_AHEAD),
        *(FaultKind.IMPOSSIBLE_TIMES, FaultKind.OTHER_MAP, FaultKind.WRONG_REPORT),
    ],
)
def test_validate_finds_fault_with_whatever_a_round_found(kind):
    """The solvers of the slow tests, without waiting for them."""
    status = (
        "invalid" if kind in (FaultKind.OTHER_MAP, FaultKind.WRONG_REPORT) else "not_comparable"
    )
    result = not_ok(status, Fault(kind=kind, detail="in any words"))
    assert not is_valid(record_of([]).model_copy(update={"outcome": result}))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FOUND, *BUSY, AHEAD, *RANDOM])
def test_the_whole_validation_certifies_none_of_them(surface, tmp_path, name):
    algorithm, registry, plugins = load_solver(f"{CHEATS}:{name}")
    asked = ValidationOptions(meshes=[surface], up_to=0, rounds=2, against=["harmonic-circle"])
    validation = examine(Solver(algorithm, plugins), registry, tmp_path / "run", asked)
    print(sentence(validation))
    assert validation.valid == ((FOUND | BUSY).get(name, AHEAD) is None)
    # Each map by itself is right: only calls that follow each other show what is wrong.
    if name in RANDOM:
        assert "repeatable" in [fault.name for fault in validation.faults]
    elif (FOUND | BUSY).get(name, FaultKind.WORKS_AHEAD) not in (None, *SINGLE):
        assert [fault.stage for fault in validation.faults] == ["quality"]
