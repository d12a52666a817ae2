"""The algorithm under test, always called in its own process."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cembench.core.arrays import Complex
from cembench.core.errors import RegistryError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import COMMAND, Algorithm, Registry, declared_by, load_registry
from cembench.results.records import Outcome
from cembench.running.local import map_once
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, Task, plan_cells
from cembench.running.plugins import load_with_plugins

#: The figure by which a map is the worst.
ANGLE = "angle_error_mean_deg"
Call = Callable[[Task], tuple[Outcome, Complex | None]]


@dataclass(frozen=True)
class CheckedMap:
    """A surface, the outcome of the call, and the map, if there is a finite one of its shape."""

    mesh: TriangleMesh
    outcome: Outcome
    uv: Complex | None


def worst_of(maps: Iterable[CheckedMap]) -> CheckedMap | None:
    """Return the map with the largest mean angle error; None if there is no map."""
    known = [(one.outcome.metrics.get(ANGLE), one) for one in maps if one.uv is not None]
    errors = [(error, k) for k, (error, _) in enumerate(known) if error is not None]
    return known[max(errors)[1]][1] if errors else None


def in_a_process(options: Options) -> Call:
    """Return a function that calls an algorithm in its own process, within these limits."""

    def call(task: Task) -> tuple[Outcome, Complex | None]:
        record, uv = map_once(task, options)
        return record.outcome, uv

    return call


@dataclass(frozen=True)
class Solver:
    """An algorithm with its parameters, and the function that calls it."""

    algorithm: Algorithm
    plugins: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    #: Threads of its numerical libraries.
    threads: int = 1
    call: Call = field(default_factory=lambda: in_a_process(Options(timeout=120.0)))

    def map(self, mesh: TriangleMesh, solves: str = "reuse") -> CheckedMap:
        """Map a surface under this linear-algebra policy, and return the checked map."""
        how = MeasurementSettings(solves=solves, threads=self.threads, repeats=1)
        (task,) = plan_cells([self.algorithm], [mesh], self.parameters, how, self.plugins)
        return CheckedMap(mesh, *self.call(task))


def load_solver(text: str) -> tuple[Algorithm, Registry, tuple[str, ...]]:
    """Load the algorithm that ``FILE.py``, ``FILE.py:name``, or a registered name refers to.

    Returns the algorithm, the registry that holds it, and the plug-ins to load for it.

    Raises
    ------
    RegistryError
        There is no such file or name, the file cannot be imported, or it declares no algorithm, or
        several without one being named.
    """
    if text.startswith(COMMAND):
        registry = load_registry([text])
        (spec,) = declared_by(text)
        return registry.algorithm(spec.name), registry, (text,)
    file, _, name = text.rpartition(":") if ".py:" in text else (text, "", "")
    if not file.endswith(".py") and ":" not in file:
        registry = load_registry()
        if file not in {**registry.algorithms, **registry.peers}:
            known = ", ".join(sorted({**registry.algorithms, **registry.peers}))
            raise RegistryError(
                f"{file!r} is neither a Python file (FILE.py, FILE.py:name, module:name) nor a "
                f"registered algorithm; those are: {known}."
            )
        return registry.algorithm(file), registry, ()
    plugin = str(Path(file).resolve()) if file.endswith(".py") else file
    registry = load_with_plugins([plugin])
    built_in = set(load_registry().algorithms)
    declared = [a for key, a in registry.algorithms.items() if key not in built_in]
    if name:
        declared = [a for a in declared if a.name == name]
    if len(declared) != 1:
        known = ", ".join(sorted(set(registry.algorithms) - built_in)) or "none"
        wanted = f"no algorithm {name!r}" if name else "not exactly one algorithm"
        raise RegistryError(
            f"{file} declares {wanted}; it declares: {known}. Name one, as in {file}:NAME."
        )
    return declared[0], registry, (plugin,)
