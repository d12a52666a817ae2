"""Call algorithms in the tests' own process: the same outcomes without the start of processes."""

import gc
from typing import ClassVar

from cembench.registry import load_registry
from cembench.running.measure import check_cell, time_cell
from cembench.validation.solver import Solver


def call_here(task):
    gc.freeze()  # a measured call collects first: only what is new since the last one
    mesh = task.mesh
    own = type(mesh).trusted(mesh.V.copy(), mesh.F.copy(), mesh.name, mesh.notices)
    return check_cell(task.algorithm, own, task.cell)


def solver_here(name, plugin=None):
    plugins = () if plugin is None else (str(plugin),)
    return Solver(load_registry(plugins).algorithm(name), plugins, call=call_here)


class LauncherHere:
    """What a run starts instead of processes; its seconds are invented.

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
        measured = time_cell(task.algorithm, task.mesh, task.cell, checked)
        seconds = 1e-6 * task.mesh.m ** self.exponents.get(task.algorithm.name, 1.0)
        half = {"factorisation": seconds / 2, "other": seconds / 2}
        return measured.model_copy(
            update={"calls": (seconds,), "cpu_seconds": seconds, "phases": half}
        )
