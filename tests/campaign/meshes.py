"""One hard mesh through one algorithm: call it, and judge what the harness says of the map."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.campaign import project
from tests.campaign.exact import circles_out_of_place, faults_of_map, overlaps
from tests.campaign.hard_meshes import hard_mesh
from tests.campaign.project import Algorithm, CembenchError, TriangleMesh
from tests.campaign.slow_metrics import conformal_energy, mean_angle_error
from tests.campaign.verdict import Verdict

#: Of so many meshes, one has its figures computed again.
EVERY = 4

#: Algorithms that try others, or end after many steps: they take one mesh of so many.
DEAR, DEAR_EVERY = ("best", "cetm-flips-overlay", "angenent-haker"), 4

#: From an algorithm and a mesh to an outcome (status, cause, notes, metrics, ...) and a map.
Check = Callable[[Algorithm, TriangleMesh], tuple[Any, Any]]


@dataclass(frozen=True)
class MeshCase:
    """A surface by its number, and an algorithm by its name."""

    number: int
    algorithm: str


def takes(number: int, algorithm: str) -> bool:
    """Tell whether an algorithm is tried on the mesh of this number."""
    return algorithm not in DEAR or number % DEAR_EVERY == 0


def judge_case(seed: int, case: MeshCase, check: Check = project.check) -> tuple[str, Verdict]:
    """Make the surface and map it: its family, and what became of it."""
    family, V, F = hard_mesh(seed, case.number)
    algorithm = project.algorithms()[case.algorithm]
    figures = case.number % EVERY == 0
    return family, judge_mesh(V, F, algorithm, check, figures=figures)


def judge_mesh(
    V: NDArray[np.float64],
    F: NDArray[np.int64],
    algorithm: Algorithm,
    check: Check = project.check,
    *,
    figures: bool = True,
) -> Verdict:
    """Map a surface and compare the harness's verdict with one in exact arithmetic.

    Refused is what no algorithm takes; skipped is a surface of a topology that this one does not
    take. With `figures`, energy and angles of a map that is ok are computed again.
    """
    try:
        TriangleMesh.from_arrays(V, F)
    except CembenchError as error:
        return Verdict("refused", None if str(error).strip() else "no message")
    except Exception as error:
        return Verdict("traceback", "traceback", f"on checking: {type(error).__name__}: {error}")
    try:
        mesh = algorithm.mesh_type.from_arrays(V, F, name="hard")
    except CembenchError:
        return Verdict("skipped")
    outcome, uv = check(algorithm, mesh)
    if outcome.status != "ok":
        return _not_ok(outcome)
    fault, detail = wrong_ok(mesh, algorithm.target, outcome, uv, figures=figures)
    return Verdict("ok", fault, detail)


def _not_ok(outcome: Any) -> Verdict:
    status = str(outcome.status)
    if outcome.traceback:
        return Verdict(status, "traceback", outcome.traceback[-800:])
    if not (outcome.cause or "").strip():
        return Verdict(status, "no message")
    if status == "out_of_memory":
        return Verdict(status, "memory", outcome.cause)
    return Verdict(status)


def wrong_ok(
    mesh: TriangleMesh, target: str, outcome: Any, uv: Any, *, figures: bool
) -> tuple[str | None, str]:
    """Return the kind of fault in an "ok", and what is wrong; None where it is right."""
    if uv is None:
        return "wrong ok", "there is no map"
    z, faces = uv.tolist(), [tuple(face) for face in mesh.F.tolist()]
    faults = faults_of_map(z, faces, target)
    if faults:
        return "wrong ok", "; ".join(faults)
    misplaced = circles_out_of_place(z, faces) if target == "circular holes" else []
    if misplaced:
        return "wrong ok", "; ".join(misplaced)
    if target == "free boundary" and not outcome.notes and overlaps(z, faces):
        return "untold overlap", "the image covers itself, and no note says so"
    missing = [name for name, value in outcome.metrics.items() if not _finite(value)]
    if missing and not outcome.notes:
        return "untold figure", f"not finite, and no note says so: {', '.join(missing)}"
    if figures:
        return _wrong_figures(mesh, z, faces, outcome.metrics)
    return None, ""


def _finite(value: Any) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)


def _wrong_figures(
    mesh: TriangleMesh, uv: list[complex], faces: list[tuple[int, ...]], metrics: Any
) -> tuple[str | None, str]:
    V = mesh.V.tolist()
    for name, reference in (
        ("conformal_energy", conformal_energy(V, faces, uv)),
        ("angle_error_mean_deg", mean_angle_error(V, faces, uv)),
    ):
        if not _finite(metrics[name]) or not reference.agrees(metrics[name]):
            told = f"{name} is {reference.value!r} within {reference.bound:.2g}"
            return "wrong figure", f"{told}; the record says {metrics[name]!r}"
    return None, ""
