"""Stage 1: whether an algorithm keeps the contract of a registered algorithm."""

from __future__ import annotations

import json
import math

import numpy as np

from cembench.core.errors import ParameterError
from cembench.registry import Algorithm, Registry
from cembench.results.records import FaultKind
from cembench.validation import surfaces
from cembench.validation.finding import ValidationFinding
from cembench.validation.solver import CheckedMap, Solver

#: Allowed distance of the last entry of the energy history from the map's E_C, over its area.
SAME_ENERGY = 1e-6


def examine_contract(solver: Solver, registry: Registry) -> list[ValidationFinding]:
    """Return the findings; if a default is out of range or there is no map, only that finding."""
    findings = [parameters_fit(solver.algorithm)]
    if not findings[0].ok:
        return findings
    kind = surfaces.mesh_kind(solver.algorithm)
    uneven = surfaces.uneven(registry, kind)
    first = solver.map(uneven)
    findings.append(returns_a_map(first))
    if not first.is_usable:
        return findings
    return [
        *findings,
        leaves_mesh_unchanged(first),
        reports_its_energy(first),
        is_repeatable(first, solver.map(uneven)),
        handles_unusual_meshes([solver.map(mesh) for mesh in surfaces.awkward(registry, kind)]),
    ]


def parameters_fit(algorithm: Algorithm) -> ValidationFinding:
    """Check that each default is within its range and can be stored in a record, as JSON."""
    wrong = []
    for parameter in algorithm.parameters:
        try:
            parameter.parse(parameter.default, algorithm.name)
            json.dumps(parameter.default, allow_nan=False)
        except (ParameterError, TypeError, ValueError) as error:
            wrong.append(f"{parameter.name}={parameter.default!r}: {error}")
    return ValidationFinding(
        stage="contract",
        name="parameters",
        ok=not wrong,
        measured="; ".join(wrong) or f"{len(algorithm.parameters)} with type and default",
        allowed="every default lies within its declared range and can be written as JSON",
        remedy="correct the default or the range in the function's signature.",
    )


def returns_a_map(mapped: CheckedMap) -> ValidationFinding:
    """Check that a call returns an array that is a map, whatever its quality."""
    outcome = mapped.outcome
    measured = f"complex128 ({mapped.mesh.n},), finite"
    if not mapped.is_usable:
        measured = f"{outcome.status} on {mapped.mesh.name}: {outcome.cause}"
    return ValidationFinding(
        stage="contract",
        name="returns a map",
        ok=mapped.is_usable,
        measured=measured,
        allowed="Parameterization(uv) with uv complex128 of shape (mesh.n,), finite",
        remedy="return Parameterization(uv), uv[k] = u + i v of vertex k; raise AlgorithmFailed "
        "where there is no map.",
    )


def leaves_mesh_unchanged(mapped: CheckedMap) -> ValidationFinding:
    """Check that the call left V and F unchanged."""
    changes = [f.detail for f in mapped.outcome.faults if f.kind is FaultKind.MESH_CHANGED]
    return ValidationFinding(
        stage="contract",
        name="mesh untouched",
        ok=not changes,
        measured="; ".join(changes) or "V and F as before",
        allowed="mesh.V and mesh.F have the same bits after the call",
        remedy="work on copies: V = mesh.V.copy().",
    )


def reports_its_energy(mapped: CheckedMap) -> ValidationFinding:
    """Check that the reported iterations are plausible, and the last energy is the map's."""
    outcome = mapped.outcome
    history, iterations = outcome.energy_history, outcome.iterations or 0
    energy, area = (outcome.metrics.get(name) or 0.0 for name in ("conformal_energy", "image_area"))
    other = outcome.extras.get("energy_of")
    off = abs(history[-1] - energy) / abs(area) if history else 0.0
    wrong = "; ".join(f.detail for f in outcome.faults if f.kind is FaultKind.WRONG_REPORT)
    if wrong:
        pass
    elif history and len(history) != iterations + 1:
        wrong = f"{len(history)} energies of {iterations} iterations"
    elif history and not other and not off <= SAME_ENERGY:
        wrong = f"the last energy is {history[-1]:.6g}, but E_C of the map is {energy:.6g}"
    right = f"{iterations} iterations, last energy off E_C by {off:.1e} of the area"
    if not history:
        right = f"{iterations} iterations, no energies"
    elif other:
        right = f"{iterations} iterations; energies are of a different kind: {other}"
    return ValidationFinding(
        stage="contract",
        name="energy history",
        ok=not wrong,
        measured=wrong or right,
        allowed=f"empty, or E_C of the start and of each iteration, the last within "
        f"{SAME_ENERGY:g} of the area",
        remedy="report E_C (Eq. 7) of the map that is returned; leave the history empty for a "
        'direct method, or say in extras["energy_of"] which other energy it is.',
    )


def is_repeatable(first: CheckedMap, second: CheckedMap) -> ValidationFinding:
    """Check that the same call in another process returns the same bits."""
    same = first.outcome.uv_hash == second.outcome.uv_hash
    apart = math.inf
    if first.uv is not None and second.uv is not None:
        apart = float(np.abs(first.uv - second.uv).max())
    return ValidationFinding(
        stage="contract",
        name="repeatable",
        ok=same,
        measured="the same bits twice" if same else f"two calls differ by up to {apart:.2g}",
        allowed="the same mesh and parameters give the same bits, in every process",
        remedy="give random numbers a seed (np.random.default_rng(0)); do not iterate over a set.",
    )


def handles_unusual_meshes(mapped: list[CheckedMap]) -> ValidationFinding:
    """Check that unusual meshes give a map, or an error with a cause."""
    bad = [m for m in mapped if not m.is_usable and not m.outcome.gave_up]
    causes = [f"{m.mesh.name}: {m.outcome.cause}" for m in bad]
    without = [m.mesh.name for m in mapped if m.outcome.gave_up]
    right = f"{len(mapped) - len(without)} of {len(mapped)} mapped"
    if without:
        right += f", gave up on {', '.join(without)} with a cause"
    return ValidationFinding(
        stage="contract",
        name="awkward meshes",
        ok=not bad,
        measured="; ".join(causes) or right,
        allowed="a finite map, or AlgorithmFailed with the cause, on any mesh of its type",
        remedy="raise cembench.AlgorithmFailed if the method does not apply.",
    )
