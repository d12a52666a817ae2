"""The whole validation: four stages, each run only if the ones before found no fault."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic
from typing import Any

from cembench.core.arrays import Complex
from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.records import DEFAULT_ROUNDS, USUAL_REFERENCES, Outcome, Record
from cembench.results.store import Store
from cembench.running.environment import describe_environment
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, Provenance, Task, plan_cells
from cembench.running.watcher import Watcher
from cembench.validation import surfaces
from cembench.validation.contract import examine_contract
from cembench.validation.correctness import as_information, examine_correctness
from cembench.validation.finding import Stage, ValidationFinding
from cembench.validation.quality import (
    comparison_with,
    folds_on,
    maps_every_surface,
    quality_findings,
    together,
    without_map,
)
from cembench.validation.scaling import (
    FIRST_ROUNDS,
    growth_of,
    largest_two,
    more_rounds,
    scales,
    seconds_a_round,
    sizes,
)
from cembench.validation.sizes import keeps_its_quality
from cembench.validation.solver import Call, CheckedMap, Solver, worst_of
from cembench.validation.verdict import Requirement, Validation, unmet

#: Reference for growth, whatever the baselines are: its seconds grow linearly at most.
_GROWTH_REFERENCE = USUAL_REFERENCES | {"circular holes": "direct-cem-holes"}


@dataclass(frozen=True)
class ValidationOptions:
    """Options of a validation."""

    #: Baselines; None: the default of the target.
    against: Sequence[str] | None = None
    #: Surfaces to compare on; empty: the default six.
    meshes: Sequence[TriangleMesh] = ()
    standing: Mapping[str, Provenance] = field(default_factory=dict)
    faces: int = 5000
    rounds: int = DEFAULT_ROUNDS
    #: Triangles of the largest mesh of the scaling stage; 0: skip the stage.
    up_to: int = 30_000
    require: Sequence[Requirement] = ()
    #: Run only the first two stages, without comparison or timing.
    checks_only: bool = False
    options: Options = field(default_factory=Options)
    command: str = ""


@dataclass(frozen=True)
class ValidationHooks:
    """Callbacks that receive the progress of a validation."""

    stage: Callable[[str], None] = lambda _: None
    watcher: Callable[[int], AbstractContextManager[Watcher]] = lambda _: nullcontext(Watcher())


def examine(
    solver: Solver,
    registry: Registry,
    folder: Path,
    asked: ValidationOptions,
    hooks: ValidationHooks | None = None,
) -> Validation:
    """Validate one algorithm; the timed runs are kept in the folder.

    Raises
    ------
    CembenchError
        A baseline or surface is unknown, or the algorithm does not take a surface; raised before
        anything is timed.
    """
    started = monotonic()
    algorithm = solver.algorithm
    _check(algorithm, asked)
    maps: list[CheckedMap] = []
    solver = replace(solver, call=_noting_maps(solver.call, maps))
    against = baselines(algorithm, registry, asked.against)
    work = _Work(solver, registry, folder, asked, hooks or ValidationHooks(), against)
    findings: list[ValidationFinding] = []
    skipped: dict[Stage, str] = {}
    parts: dict[str, Any] = {}
    measured: list[Record] = []
    looked_at: dict[Stage, tuple[int, int]] = {}
    for stage, examined in _STAGES.items():
        fault = next((finding.stage for finding in findings if not finding.ok), None)
        if not _is_asked(stage, asked):
            skipped[stage] = "not asked for"
        elif fault is not None:
            skipped[stage] = f"not examined, because of a fault in {fault}"
        else:
            work.hooks.stage(stage)
            maps.clear()
            checked, figures, records = examined(work)
            findings += checked
            parts |= figures
            measured += records
            seen = [one.mesh.m for one in maps if one.uv is not None]
            seen += [record.mesh.faces for record in records if record.outcome.metrics]
            if seen:
                looked_at[stage] = min(seen), max(seen)
            parts["worst"] = worst_of(maps) or parts.get("worst")
    validation = Validation(
        algorithm=algorithm.name,
        title=algorithm.title,
        target=algorithm.target,
        conformal=algorithm.conformal,
        source=_source(solver),
        parameters=algorithm.arguments(solver.parameters),
        command=asked.command,
        environment=describe_environment()["id"],
        findings=tuple(findings),
        skipped=skipped,
        looked_at=looked_at,
        folds_on=tuple(folds_on(measured)),
        no_map_on=without_map(measured),
        not_asked_for=tuple(stage for stage in skipped if not _is_asked(stage, asked)),
        seconds=monotonic() - started,
        **parts,
    )
    if not validation.valid:
        return validation
    return validation.model_copy(update={"unmet": unmet(asked.require, validation)})


def _check(algorithm: Algorithm, asked: ValidationOptions) -> None:
    """Raise :class:`ParameterError` for what cannot be examined, before anything is timed."""
    if algorithm.target == "atlas":
        raise ParameterError(
            f"{algorithm.name} makes an atlas, but validate examines maps with one UV per vertex. "
            "Measure it with `cembench run` or `cembench peers`, which have figures for islands."
        )
    if asked.checks_only and asked.require:
        raise ParameterError(
            "`require` needs the stages that `checks_only` leaves out; leave one of them out."
        )
    if asked.up_to:
        sizes(asked.up_to)


def _noting_maps(call: Call, maps: list[CheckedMap]) -> Call:
    """Return the call, which then notes each surface with its map."""

    def noting(task: Task) -> tuple[Outcome, Complex | None]:
        maps.append(CheckedMap(task.mesh, *call(task)))
        return maps[-1].outcome, maps[-1].uv

    return noting


def _source(solver: Solver) -> str:
    """Return the origin of the algorithm: a command, a plug-in or a module."""
    if solver.algorithm.program is not None:
        return str(solver.algorithm.program)
    return solver.plugins[0] if solver.plugins else solver.algorithm.origin


@dataclass(frozen=True)
class _Work:
    """The input of every stage."""

    solver: Solver
    registry: Registry
    folder: Path
    asked: ValidationOptions
    hooks: ValidationHooks
    baselines: tuple[str, ...]

    @property
    def name(self) -> str:
        return self.solver.algorithm.name

    @property
    def kind(self) -> type[TriangleMesh]:
        return surfaces.mesh_kind(self.solver.algorithm)

    def ours(self, records: Sequence[Record]) -> list[Record]:
        """Return the records of the algorithm that is examined."""
        return [record for record in records if record.cell.algorithm == self.name]

    def measured(
        self, stage: Stage, meshes: Sequence[TriangleMesh], beside: Sequence[str], rounds: int
    ) -> list[Record]:
        """Measure the algorithms side by side in one sitting; earlier records are not used."""
        chosen = [self.solver.algorithm, *(self.registry.algorithm(name) for name in beside)]
        parameters = {f"{self.name}.{key}": value for key, value in self.solver.parameters.items()}
        how = MeasurementSettings(threads=self.solver.threads, repeats=rounds)
        plan = (how, self.solver.plugins, self.asked.standing)
        tasks = plan_cells(chosen, meshes, parameters, *plan)
        options = replace(self.asked.options, fresh=True)
        with self.hooks.watcher(len(tasks)) as watcher:
            return run_tasks(tasks, Store(self.folder / stage), options, watcher)


#: What a stage finds, its figures, and its records of our algorithm.
_Found = tuple[list[ValidationFinding], dict[str, Any], list[Record]]


def _quality(work: _Work) -> _Found:
    meshes = list(work.asked.meshes)
    meshes = meshes or surfaces.compared(work.registry, work.kind, work.asked.faces)
    records = work.measured("quality", meshes, work.baselines, work.asked.rounds)
    ours = work.ours(records)
    figures = {
        "surfaces": tuple(mesh.name for mesh in meshes),
        "against": together([comparison_with(records, work.name, b) for b in work.baselines]),
    }
    return quality_findings(ours), figures, ours


def _scaling(work: _Work) -> _Found:
    meshes = surfaces.growing(work.registry, work.kind, sizes(work.asked.up_to))
    beside = usual_rival(work.solver.algorithm, work.registry, _GROWTH_REFERENCE)
    others = tuple(dict.fromkeys((*beside, *work.baselines)))
    started = monotonic()
    sittings = [work.measured("scaling", meshes, others, FIRST_ROUNDS)]
    ours = work.ours(sittings[0])
    at_sizes = tuple(comparison_with(sittings[0], work.name, other) for other in others)
    findings = [keeps_its_quality(compared) for compared in at_sizes[: len(beside)]]
    if not work.solver.algorithm.conformal:
        findings = [as_information(one) for one in findings]
    findings.insert(0, maps_every_surface("scaling", ours))
    figures: dict[str, Any] = {"at_sizes": at_sizes}
    while True:
        growth = growth_of(sittings, work.name, beside[0] if beside else None)
        if growth is None:
            return [*findings, scales(None)], figures, ours
        two_largest = set(largest_two(sittings[0], work.name))
        timed = {work.name, *beside}
        on_largest = [record for record in sittings[-1] if record.cell.mesh in two_largest]
        again = [record for record in on_largest if record.cell.algorithm in timed]
        more = more_rounds(growth, monotonic() - started, seconds_a_round(again))
        if not more:
            return [*findings, scales(growth)], figures | {"growth": growth}, ours
        largest = [mesh for mesh in meshes if mesh.name in two_largest]
        sittings.append(work.measured("scaling", largest, beside, more))


_STAGES: dict[Stage, Callable[[_Work], _Found]] = {
    "contract": lambda work: (examine_contract(work.solver, work.registry), {}, []),
    "correctness": lambda work: (examine_correctness(work.solver, work.registry), {}, []),
    "quality": _quality,
    "scaling": _scaling,
}


def _is_asked(stage: Stage, asked: ValidationOptions) -> bool:
    if stage in ("contract", "correctness"):
        return True
    return not asked.checks_only and (stage == "quality" or asked.up_to > 0)


def fits(algorithm: Algorithm, other: Algorithm) -> bool:
    """Whether an algorithm can be compared with another one: it takes the same surfaces."""
    kind = surfaces.mesh_kind(algorithm)
    return other.name != algorithm.name and issubclass(kind, other.mesh_type)


def usual_rival(
    algorithm: Algorithm, registry: Registry, of_targets: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the algorithm that those of a target are compared with; none if it does not fit."""
    other = registry.algorithms.get(of_targets.get(algorithm.target, ""))
    return (other.name,) if other and fits(algorithm, other) else ()


def baselines(
    algorithm: Algorithm, registry: Registry, asked: Sequence[str] | None
) -> tuple[str, ...]:
    """Return the names of the baselines; by default the usual one of the target, if it fits.

    Raises
    ------
    RegistryError
        A name is unknown.
    ParameterError
        A baseline takes other surfaces, or is the algorithm itself.
    """
    if asked is None:
        return usual_rival(algorithm, registry, USUAL_REFERENCES)
    for name in asked:
        if not fits(algorithm, registry.algorithm(name)):
            fitting = [one.name for one in registry.algorithms.values() if fits(algorithm, one)]
            raise ParameterError(
                f"against={name!r}: {algorithm.name} cannot be compared with it; algorithms that "
                f"take a {surfaces.mesh_kind(algorithm).__name__}: {', '.join(fitting) or 'none'}."
            )
    return tuple(dict.fromkeys(asked))
