"""Whatever an algorithm returns or raises is a cell's fault with a cause, and small."""

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, Parameterization, algorithm
from cembench.core.clock import phase
from cembench.results.records import FaultKind
from cembench.running.map_checks import Checked
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.sanitized_result import Returned
from cembench.running.worker import Answer
from tests.validation.in_this_process import time_cell

MESH = flat_disk(100)
FLAT = MESH.V[:, 0] + 1j * MESH.V[:, 1]


class Hostile(np.ndarray):
    """An array that answers nothing."""

    def __eq__(self, other):
        raise ZeroDivisionError

    def __array_finalize__(self, made_from):
        """It can be viewed."""

    def __array_ufunc__(self, *arguments, **options):
        raise ZeroDivisionError

    def tobytes(self):
        raise ZeroDivisionError

    shape = property(lambda self: 1 / 0)


class Sub(Parameterization):
    """A result that cannot be read."""

    uv = property(lambda self: 1 / 0, lambda self, value: None)


class Own(Parameterization):
    """A result that decides itself what its attributes are."""

    def __getattribute__(self, name):
        return object.__getattribute__(self, name)


class Lies:
    """It says that it is an array."""

    __class__ = np.ndarray

    def __array__(self, dtype=None, copy=None):
        return FLAT


class MuteError(Exception):
    """An exception that cannot say its message."""

    def __str__(self):
        raise ZeroDivisionError


def nested(depth):
    made = []
    for _ in range(depth):
        made = [made]
    return made


def endless():
    while True:
        yield 1.0


def solver_of(make):
    """A solver whose result this makes, and its cell."""

    @algorithm("given", title="Given", target="disk")
    def given(mesh: DiskMesh) -> Parameterization:
        return make()

    (task,) = plan_cells([given.__cembench__], [MESH], {}, MeasurementSettings(repeats=1))
    return task.algorithm, task.cell


def through_a_file(**found):
    text = Answer(**found).model_dump_json()
    assert len(text) < 2**24
    return Answer.model_validate_json(text)


def outcome_of(make):
    """The outcome of a call, after it went through a process's file."""
    spec, cell = solver_of(make)
    return through_a_file(outcome=check_cell(spec, MESH, cell)[0]).outcome


def result(**about):
    return lambda: Parameterization(FLAT.copy(), **about)


@pytest.mark.parametrize(
    ("make", "kind", "cause"),
    [
        (lambda: None, FaultKind.NOT_A_PARAMETERIZATION, "returned a NoneType"),
        (lambda: endless(), FaultKind.NOT_A_PARAMETERIZATION, "returned a generator"),
        (lambda: Sub(FLAT), FaultKind.RAISED, "its uv cannot be read: ZeroDivisionError"),
        (lambda: Own(FLAT), FaultKind.NOT_A_PARAMETERIZATION, "Own defines __getattribute__"),
        (lambda: Parameterization(Lies()), FaultKind.WRONG_SHAPE, "uv is Lies; required is"),
        (lambda: Parameterization(list(FLAT)), FaultKind.WRONG_SHAPE, "uv is list"),
        (lambda: Parameterization(FLAT.astype(object)), FaultKind.WRONG_SHAPE, "uv is object"),
        (lambda: Parameterization(FLAT * np.nan), FaultKind.NOT_FINITE, "NaN or infinite"),
        (result(iterations=2.5), FaultKind.WRONG_REPORT, "iterations is 2.5; required"),
        (result(iterations=None), FaultKind.WRONG_REPORT, "iterations is a NoneType"),
        (result(iterations=-1), FaultKind.WRONG_REPORT, "iterations is a int; allowed is 0"),
        (result(iterations=10**400), FaultKind.WRONG_REPORT, "allowed is 0 to 2^53"),
        (result(energy_history=(1.0, np.nan)), FaultKind.WRONG_REPORT, "holds nan at position 1"),
        (result(energy_history="12"), FaultKind.WRONG_REPORT, "holds '1' at position 0"),
        (result(energy_history=(1j,)), FaultKind.WRONG_REPORT, "holds a complex at position 0"),
        (result(energy_history=endless()), FaultKind.WRONG_REPORT, "more than 100,000 energies"),
        (result(energy_history=None), FaultKind.WRONG_REPORT, "energy_history TypeError"),
        (result(extras=[1]), FaultKind.WRONG_REPORT, "extras is a list; required is a dict"),
        (result(extras={1: 2}), FaultKind.WRONG_REPORT, "extras has names that are not strings"),
        (result(extras={"x": "y" * 10**7}), FaultKind.WRONG_REPORT, "extras takes 10,000,008"),
        (result(extras={"x": object()}), FaultKind.WRONG_REPORT, "cannot be written as JSON"),
        (result(extras={"x": nested(10**4)}), FaultKind.WRONG_REPORT, "cannot be written as JSON"),
        (result(extras={"\ud800": 1}), FaultKind.WRONG_REPORT, "cannot be written as JSON"),
    ],
)
def test_a_result_that_breaks_the_contract_is_invalid_with_its_cause(make, kind, cause):
    outcome = outcome_of(make)
    assert outcome.status == "invalid"
    assert outcome.faults[0].kind is kind
    assert cause in outcome.cause
    assert len(outcome.cause) < 3000


def test_figures_are_kept_where_only_the_report_is_wrong():
    outcome = outcome_of(result(iterations=3, extras=[1]))
    assert outcome.metrics["flipped_triangles"] == 0
    assert outcome.iterations == 3
    assert outcome.extras == {}


def raising(error):
    def make():
        raise error

    return make


@pytest.mark.parametrize(
    ("error", "cause"),
    [
        (MuteError(), "MuteError: (its message cannot be read: ZeroDivisionError)"),
        (ValueError("x" * 10**7), "xxx ... xxx"),
        (ValueError("\ud800"), "ValueError: ?"),
        (SystemExit(0), "SystemExit: 0"),
        (KeyboardInterrupt(), "KeyboardInterrupt: "),
        (GeneratorExit("by me"), "GeneratorExit: by me"),
    ],
)
def test_whatever_is_raised_is_a_failure_with_its_cause(error, cause):
    outcome = outcome_of(raising(error))
    assert outcome.status == "failed"
    assert outcome.faults[0].kind is FaultKind.RAISED
    assert cause in outcome.cause
    assert len(outcome.cause) <= 2000
    assert 0 < len(outcome.traceback) <= 20_000


def test_an_array_with_methods_of_its_own_is_taken_for_what_it_holds():
    outcome = outcome_of(lambda: Parameterization(FLAT.view(Hostile)))
    assert (outcome.status, outcome.cause) == ("ok", None)
    assert outcome.uv_hash == outcome_of(result()).uv_hash


def test_a_map_is_read_once_and_copied_so_later_changes_have_no_effect():
    looks = []

    class Counted(Parameterization):
        """It counts how often its map is read."""

        @property
        def uv(self):
            looks.append(True)
            return held

        @uv.setter
        def uv(self, value):
            """It is held elsewhere."""

    held = np.asfortranarray(np.stack([FLAT, FLAT]).T)[:, 0].view(Hostile)
    returned = Returned.of(Counted(None), MESH)
    np.ndarray.fill(held, 0)
    assert len(looks) == 1
    assert type(returned.uv) is np.ndarray
    assert returned.uv.flags.c_contiguous
    np.testing.assert_array_equal(returned.uv, FLAT)


def phases(*names):
    def make():
        for name in names:
            with phase(name):
                """It takes no time."""
        return Parameterization(FLAT.copy())

    return make


@pytest.mark.parametrize(
    ("names", "cause"),
    [
        ((5,), "a phase's name is not a text"),
        (("x" * 101,), "a phase's name is not a text"),
        (map(str, range(200)), "201 phases; allowed are at most 100"),
    ],
)
def test_phases_are_few_and_have_names(names, cause):
    names = tuple(names)
    outcome = outcome_of(phases(*names))
    assert outcome.status == "invalid"
    assert cause in outcome.cause


@pytest.mark.parametrize(
    ("make", "kinds"),
    [
        (lambda: None, [FaultKind.OTHER_MAP, FaultKind.NOT_A_PARAMETERIZATION]),
        (raising(KeyboardInterrupt()), [FaultKind.RAISED]),
        (phases(5), [FaultKind.WRONG_REPORT]),
    ],
)
def test_timed_calls_are_taken_apart_alike(make, kinds):
    spec, cell = solver_of(make)
    found = through_a_file(outcome=time_cell(spec, MESH, cell, Checked())).outcome
    assert [fault.kind for fault in found.faults] == kinds


def test_a_map_too_large_for_its_figures_is_invalid():
    outcome = outcome_of(lambda: Parameterization(FLAT * 1e300))
    assert outcome.status == "invalid"
    assert outcome.faults[0].kind is FaultKind.OFF_CIRCLE


def test_numpy_s_own_numbers_are_numbers():
    outcome = outcome_of(
        result(iterations=np.int64(1), energy_history=np.array([2.0, 1.0], dtype=np.float32))
    )
    assert (outcome.status, outcome.iterations, outcome.energy_history) == ("ok", 1, (2.0, 1.0))
