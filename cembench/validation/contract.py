"""Stage 1: whether an algorithm keeps the contract of a registered algorithm."""

from __future__ import annotations

import json
import math
from functools import partial

import numpy as np

from cembench.conformal.laplacian import delaunay_laplacian
from cembench.core.errors import ParameterError
from cembench.registry import Algorithm, Registry
from cembench.results.records import FaultKind
from cembench.running.map_checks import SAME_MAP
from cembench.validation import surfaces
from cembench.validation.alignment import distance
from cembench.validation.finding import ValidationFinding, finding
from cembench.validation.solver import CheckedMap, Solver

_finding = partial(finding, "contract")

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
    if first.uv is None:
        return findings
    return [
        *findings,
        leaves_mesh_unchanged(first),
        reports_its_energy(first),
        is_repeatable(first, solver.map(uneven)),
        *_depends_on_triangles(solver, first),
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
    right = f"{len(algorithm.parameters)} with type and default"
    return _finding("parameters", "; ".join(wrong) or right, ok=not wrong)


def returns_a_map(mapped: CheckedMap) -> ValidationFinding:
    """Check that a call returns an array that is a map, whatever its quality."""
    outcome = mapped.outcome
    measured = f"complex128 ({mapped.mesh.n},), finite"
    if mapped.uv is None:
        measured = f"{outcome.status} on {mapped.mesh.name}: {outcome.cause}"
    return _finding("returns a map", measured, ok=mapped.uv is not None)


def leaves_mesh_unchanged(mapped: CheckedMap) -> ValidationFinding:
    """Check that the call left V and F unchanged."""
    changes = [f.detail for f in mapped.outcome.faults if f.kind is FaultKind.MESH_CHANGED]
    return _finding("mesh untouched", "; ".join(changes) or "V and F as before", ok=not changes)


def reports_its_energy(mapped: CheckedMap) -> ValidationFinding:
    """Check that the reported iterations are plausible, and the last energy is the map's."""
    outcome = mapped.outcome
    history, iterations = outcome.energy_history, outcome.iterations or 0
    energy, area = (outcome.metrics.get(name) or 0.0 for name in ("conformal_energy", "image_area"))
    other = outcome.extras.get("energy_of")
    off = abs(history[-1] - energy) / abs(area) if history else 0.0
    if off > SAME_ENERGY and not other and mapped.uv is not None:
        L, _ = delaunay_laplacian(mapped.mesh)  # its cotangents give an E_C too
        delaunay = 0.5 * np.vdot(mapped.uv, L @ mapped.uv).real - area
        off = min(off, abs(history[-1] - delaunay) / abs(area))
    wrong = "; ".join(f.detail for f in outcome.faults if f.kind is FaultKind.WRONG_REPORT)
    if not wrong and history and len(history) != iterations + 1:
        wrong = f"{len(history)} energies of {iterations} iterations"
    if not wrong and history and not other and not off <= SAME_ENERGY:
        wrong = f"the last energy is {history[-1]:.6g}, but E_C of the map is {energy:.6g}"
    right = f"{iterations} iterations, last energy off E_C by {off:.1e} of the area"
    if not history:
        right = f"{iterations} iterations, no energies"
    elif other:
        right = f"{iterations} iterations; energies are of a different kind: {other}"
    return _finding("energy history", wrong or right, ok=not wrong, within=SAME_ENERGY)


def is_repeatable(first: CheckedMap, second: CheckedMap) -> ValidationFinding:
    """Check that the same call in another process returns the same bits."""
    same = first.outcome.uv_hash == second.outcome.uv_hash
    apart = math.inf
    if first.uv is not None and second.uv is not None:
        apart = float(np.abs(first.uv - second.uv).max())
    measured = "the same bits twice" if same else f"two calls differ by up to {apart:.2g}"
    return _finding("repeatable", measured, ok=same)


def _depends_on_triangles(solver: Solver, first: CheckedMap) -> list[ValidationFinding]:
    """Check what is declared with combinatorial=True, up to the gauge; else there is no finding."""
    if not solver.algorithm.combinatorial:
        return []
    second = solver.map(surfaces.reshaped(first.mesh))
    apart = math.inf
    if first.uv is not None and second.uv is not None:
        free = solver.algorithm.target == "free boundary"
        apart = distance(second.uv, first.uv, moebius=not free)
    measured = f"maps of two shapes with the same triangles differ by {apart:.2g}"
    return [_finding("combinatorial", measured, ok=apart <= SAME_MAP, within=SAME_MAP)]


def handles_unusual_meshes(mapped: list[CheckedMap]) -> ValidationFinding:
    """Check that unusual meshes give a map, or an error with a cause."""
    bad = [m for m in mapped if m.uv is None and not m.outcome.gave_up]
    causes = [f"{m.mesh.name}: {m.outcome.cause}" for m in bad]
    without = [m.mesh.name for m in mapped if m.outcome.gave_up]
    right = f"{len(mapped) - len(without)} of {len(mapped)} mapped"
    if without:
        right += f", gave up on {', '.join(without)} with a cause"
    return _finding("awkward meshes", "; ".join(causes) or right, ok=not bad)
