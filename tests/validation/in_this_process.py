"""Call algorithms in the tests' own process: the same outcomes without the start of processes."""

import gc
from typing import ClassVar

import pytest

from cembench.registry import load_registry
from cembench.results.records import Fault, Outcome, not_ok
from cembench.running import measure
from cembench.running.map_checks import judged_calls
from cembench.running.map_promises import Promise
from cembench.running.measure import Timed, check_cell, timed_together
from cembench.validation.solver import Solver


def call_here(task):
    gc.freeze()  # a measured call collects first: only what is new since the last one
    mesh = task.mesh
    own = type(mesh).trusted(mesh.V.copy(), mesh.F.copy(), mesh.name, mesh.notices)
    return check_cell(task.algorithm, own, task.cell)


def time_cell(algorithm, mesh, cell, checked):
    """Time calls on the original surface, and judge their maps here."""
    timed = timed_together(mesh, [Timed(algorithm, cell)])
    if isinstance(timed, Outcome):
        return timed
    ((measured, calls),) = timed[0]
    maps = zip(calls.names(), calls.calls, strict=True)
    named = [(name, c.motion, c.uv) for name, c in maps if not isinstance(c.uv, Fault)]
    judged = judged_calls(Promise.of(algorithm), mesh, checked, named, {})
    if judged.faults:
        return not_ok("invalid", *judged.faults)
    return measured.model_copy(update={"repeated": judged.repeated})


def solver_here(name, plugin=None):
    plugins = () if plugin is None else (str(plugin),)
    return Solver(load_registry(plugins).algorithm(name), plugins, call=call_here)


class TimerHere:
    """Checks and times cells in this process; its seconds are invented.

    A verdict on speed or growth must not come from the clock of a busy machine: a call takes
    faces^exponent microseconds, half of that for the factorisation.
    """

    #: Of algorithms whose seconds do not grow linearly.
    exponents: ClassVar = {"quadratic": 2.0}

    def __init__(self, scratch, options):
        self.scratch, self.options = scratch, options

    def close(self):
        """There is nothing to end."""

    def check(self, task):
        return call_here(task)

    def time(self, task, checked):
        gc.freeze()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(measure, "ENOUGH_CALLS", 4)  # of twenty, which take seconds to average
            measured = time_cell(task.algorithm, task.mesh, task.cell, checked)
        seconds = 1e-6 * task.mesh.m ** self.exponents.get(task.algorithm.name, 1.0)
        half = {"factorisation": seconds / 2, "other": seconds / 2}
        return measured.model_copy(
            update={"calls": (seconds,), "cpu_seconds": seconds, "phases": half}
        )
