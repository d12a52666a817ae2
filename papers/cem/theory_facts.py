"""Results of testing the paper's Section 4 on a surface, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cembench.conformal.certificate import certify
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm, load_registry
from cembench.running.plan import provenance_of

from .boundary_operator import (
    TOLERANCE,
    BoundaryOperator,
    Check,
    Trajectory,
    predicted_rate,
    premises,
    statements,
    trajectory,
)

#: The algorithm whose energies are compared with CEM's, if installed.
RIVAL = "direct-cem"
#: Parameters for the least E_C with the weights of K, those of the mesh's own edges.
RIVAL_PARAMETERS = {"delaunay": False, "back": 0.0}
#: Numbers of iterations in the table of energies.
LOOKS = (0, 20, 200)
#: Maximum number of boundary vertices for which K is formed.
DENSE = 1200


@dataclass(frozen=True)
class TheoryFacts:
    """Premises and statements of Section 4 on a surface, with the data behind them.

    Attributes
    ----------
    facts : mapping
        All results as plain data, as printed by `cembench theory --json`.
    premises, statements : tuple of Check
        Each check has a figure, its meaning, and whether it holds.
    trajectories : mapping
        The bare iterations (23) and (30) of CEM, by name.
    others : mapping
        Energies of another algorithm's iterations, by its title.
    spectrum : list of float
        Eigenvalues of K: all of them if K is small enough to be formed, else the leading ones.
    missing : str
        Why there is no other algorithm; empty if there is one.
    """

    facts: Mapping[str, Any]
    premises: tuple[Check, ...]
    statements: tuple[Check, ...]
    trajectories: Mapping[str, Trajectory]
    others: Mapping[str, tuple[float, ...]]
    spectrum: list[float]
    missing: str = ""


def theory_facts(mesh: DiskMesh, rival: Algorithm | None, iterations: int) -> TheoryFacts:
    """Return the results, with the energies of `rival` besides those of CEM."""
    K = BoundaryOperator(mesh)
    dense = K.size <= DENSE
    paths = {
        "CEM, step (23)": trajectory(K, iterations, inversion=False),
        "CEM, step (30)": trajectory(K, iterations, inversion=True),
    }
    plain, inverse = paths.values()
    assumed, said = premises(K), statements(K, plain, inverse, dense=dense)
    leading, _ = K.leading_eigenpairs()
    others, missing = _rival_history(rival, mesh)
    rate = predicted_rate(leading)
    facts: dict[str, Any] = {
        "mesh": mesh.name,
        "origin": _origin(mesh),
        "vertices": mesh.n,
        "boundary_vertices": K.size,
        "premises_hold": all(check.holds for check in assumed),
        # Statements that the paper does not claim are not counted.
        "statements_hold": all(c.holds for c in said if c.source != "not claimed"),
        "premises": [asdict(check) for check in assumed],
        "statements": [asdict(check) for check in said],
        "eigenvalues": leading.tolist(),
        "gap": float(1 - leading[1]),
        "rate_predicted": rate,
        "rate_23": plain.rate,
        "rate_30": inverse.rate,
        "rises_23": _rises(plain),
        "rises_30": _rises(inverse),
        "energies": _energies(paths, others),
        "certificate": _certificate(mesh, paths, K.start()),
    }
    spectrum = (K.spectrum() if dense else leading).tolist()
    return TheoryFacts(facts, tuple(assumed), tuple(said), paths, others, spectrum, missing)


def _certificate(mesh: DiskMesh, paths: Mapping[str, Trajectory], start: Any) -> dict[str, Any]:
    """Return the modulus of the surface with four boundary points, and the errors of CEM's maps."""
    try:
        certificate = certify(mesh)
    except AlgorithmFailed as error:
        return {"missing": str(error)}
    place = [int(np.flatnonzero(mesh.boundary == corner)[0]) for corner in certificate.corners]
    ends = {"CEM, start": start} | {name: path.boundary for name, path in paths.items()}
    off = {name: certificate.off(z[place]) for name, z in ends.items()}
    return {
        "corners": certificate.corners.tolist(),
        "lower": certificate.lower,
        "upper": certificate.upper,
        "modulus": certificate.modulus,
        "reciprocal_error": certificate.reciprocal_error,
        "off": {name: value if np.isfinite(value) else None for name, value in off.items()},
    }


def _rises(path: Any) -> dict[str, float | int]:
    """Return how often E_C rises by more than rounding, and the total and largest rise."""
    rises = path.rises[path.rises > TOLERANCE * abs(path.energies[0])]
    return {
        "count": len(rises),
        "largest": float(rises.max(initial=0.0)),
        "together": float(rises.sum()),
    }


def _origin(mesh: DiskMesh) -> str:
    """Return whether a surface is a model of the paper, a stand-in for one, or neither."""
    registry = load_registry()
    made = registry.surfaces.get(mesh.name)
    return "stand-in" if made and made.paper_row else provenance_of(registry, mesh).origin


def _rival_history(
    rival: Algorithm | None, mesh: DiskMesh
) -> tuple[dict[str, tuple[float, ...]], str]:
    """Return the energies of the rival algorithm, or why there are none."""
    if rival is None or not isinstance(mesh, rival.mesh_type):
        return {}, f"{RIVAL} is not installed here." if rival is None else ""
    try:
        result = rival.function(mesh.fresh(), **rival.arguments(RIVAL_PARAMETERS))
    except AlgorithmFailed as error:
        return {}, f"{rival.title} failed: {error}."
    if not result.energy_history:
        return {}, f"{rival.title} reports no energies."
    return {rival.title: result.energy_history}, ""


def _energies(paths: Any, others: Any) -> list[dict[str, Any]]:
    """Return E_C at the start, after 20 and 200 iterations, and the lowest; None if missing."""
    curves = {name: path.energies.tolist() for name, path in paths.items()}
    curves |= {name: list(history) for name, history in others.items()}
    rows = []
    for name, curve in curves.items():
        at = {f"after_{k}": curve[k] if k < len(curve) else None for k in LOOKS}
        rows.append({"name": name} | at | {"last": curve[-1], "iterations": len(curve) - 1})
    return rows
