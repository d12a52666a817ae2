"""Measure one algorithm on one surface in this process, and check what it returns.

Timed is the call alone, from the arrays V and F in memory to uv: the boundary loops, the Laplacian,
ordering, factorisation and iterations, and nothing else. An algorithm's word is not trusted: every
map, checked or timed, is judged (:mod:`cembench.running.judge`), and the metrics are computed here.
"""

from __future__ import annotations

import gc
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from cembench.conformal.atlas import atlas_metrics
from cembench.conformal.metrics import (
    all_metrics,
    boundary_circles,
    dirichlet_energy,
    image_area,
    lost_in_rounding,
)
from cembench.core.clock import Timing, measure
from cembench.core.errors import NotThere, said_by
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import (
    Boundary,
    Cell,
    Fault,
    FaultKind,
    Outcome,
    ProgramRun,
    Round,
    not_ok,
)
from cembench.running.external.call import ProgramCalls
from cembench.running.external.present import library_version, missing
from cembench.running.judge import faults, remarks
from cembench.running.memory import Memory, memory_of_call
from cembench.running.processor import processor_now
from cembench.running.quality import quality_notes
from cembench.running.returned import (
    hash_of,
    map_of,
    outcome_of_error,
    phases_fault,
    report_of,
)

#: A process times further calls until they have taken so many seconds together, or are so many.
ENOUGH_SECONDS = 0.1
ENOUGH_CALLS = 5
#: A first call that takes so many seconds is not repeated: a warm-up saves tenths of one.
LONG_CALL = 5.0
#: How far E_C of a timed call's map may be from that of the checked one, relative to its area: two
#: maps of a solver that draws random numbers differ by less, one that stops earlier by more.
SAME_ENERGY = 1e-6

Complex = NDArray[np.complex128]
Call = Callable[[], tuple[Any, Timing]]


class Checked(BaseModel):
    """What a timed call's map is compared with: bits and E_C over area of the checked map."""

    uv_hash: str | None = None
    #: None: only the promises of the target are judged.
    relative_energy: float | None = None

    @classmethod
    def of(cls, outcome: Outcome) -> Checked:
        """Return what there is to compare with a checked call."""
        energy, area = (outcome.metrics.get(name) for name in ("conformal_energy", "image_area"))
        relative = None if energy is None or not area else energy / area
        return cls(uv_hash=outcome.uv_hash, relative_energy=relative)


def check_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell
) -> tuple[Outcome, Complex | None]:
    """Call once: is the result a valid map, and how much memory does the call take?

    Never raises for what the algorithm does: an exception, also one that would end the process, is
    a status with its cause. The one round of the outcome is this call, without warm-up. The second
    value is the map, also that of an invalid one if it has the right shape and is finite.
    """
    call = _call(algorithm, mesh, cell)
    program: dict[str, Any] = {}
    try:
        if isinstance(call, ProgramCalls):
            found, timing = call(watched=True)
            memory = Memory(call.peak, call.peak)
            program = _about_program(call)
        else:
            with linear_algebra(cell.solves, cell.backend):
                (found, timing), memory = memory_of_call(lambda: _without_collector(call))
    except BaseException as error:
        return outcome_of_error(error, mesh), None
    if algorithm.library is not None:
        program = {"program": ProgramRun(version=library_version(algorithm.library))}
    uv = map_of(found, mesh, algorithm.target)
    if isinstance(uv, Fault):
        return _with_memory(not_ok("invalid", uv).model_copy(update=program), memory), None
    report, problems = report_of(found)
    seconds = phases_fault(timing)
    problems += [seconds] if seconds else []
    try:
        about, more = _judged(algorithm, mesh, uv, report.get("extras", {}))
    except MemoryError as error:
        return outcome_of_error(error, mesh), None
    except Exception as error:
        about, more = {}, [_no_metrics(error)]
    problems = [*more, *_changes(mesh, cell), *problems]
    outcome = not_ok("invalid", *problems) if problems else Outcome(status="ok")
    about["notes"] = (*about.get("notes", ()), *program.pop("notes", ()))
    start = program.pop("start", None)
    described = about | report | program | {"uv_hash": hash_of(uv)}
    if seconds is None:
        described["rounds"] = (_program_round(_round([timing]), call, 1, start),)
    return _with_memory(outcome.model_copy(update=described), memory), uv


def time_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell, checked: Checked
) -> Round | Outcome:
    """Time a call, after one to warm up; several calls where they are short.

    A call of more than :data:`LONG_CALL` seconds is timed without a warm-up. The maps are judged
    when all is timed. An outcome where the algorithm raised, or a call returned a worse map than
    the one that was checked.
    """
    call = _call(algorithm, mesh, cell)
    try:
        with linear_algebra(cell.solves, cell.backend):
            timings, maps, used = _timed(call, mesh, algorithm.target)
        start = call.start_seconds(len(timings)) if isinstance(call, ProgramCalls) else None
    except BaseException as error:
        return outcome_of_error(error, mesh)
    problems = [fault for t in timings if (fault := phases_fault(t))][:1]
    try:
        problems += _other_maps(algorithm, mesh, maps, checked)
    except MemoryError as error:
        return outcome_of_error(error, mesh)
    except Exception as error:
        problems.append(_no_metrics(error))
    problems += _changes(mesh, cell)
    if problems:
        return not_ok("invalid", *problems)
    hashes = [hash_of(uv) for uv in maps if not isinstance(uv, Fault)]
    same = tuple(found == checked.uv_hash for found in hashes)
    found = _program_round(_round(timings, used), call, len(timings), start)
    return found.model_copy(update={"uv_hash": hashes[-1], "same_bits": same})


def _about_program(call: ProgramCalls) -> dict[str, Any]:
    """Return what an outcome says of a program besides its map; nobody knows its iterations."""
    start = call.start_seconds(1)
    about = {"program": call.facts(), "notes": call.notices(start), "start": start}
    return about | {"iterations": None}


def _program_round(measured: Round, call: Call, calls: int, start: float | None) -> Round:
    """Add to a round what an external program's process costs besides."""
    if not isinstance(call, ProgramCalls):
        return measured
    own = call.own_seconds(calls)
    return measured.model_copy(update={"start_seconds": start, "own_seconds": own})


def _timed(
    call: Call, mesh: TriangleMesh, target: str
) -> tuple[list[Timing], list[Complex | Fault], list[float]]:
    """Return the timed calls, the map of each as it was right after it, and its CPU seconds."""
    found, timing, used = _with_processor(call)
    if timing.total > LONG_CALL:
        return [timing], [map_of(found, mesh, target)], [used]
    timings: list[Timing] = []
    maps: list[Complex | Fault] = []
    processor: list[float] = []
    gc.collect()
    gc.freeze()  # collecting again looks at what is new, and leaves the rest out of the caches
    while len(timings) < ENOUGH_CALLS and sum(t.total for t in timings) < ENOUGH_SECONDS:
        found, timing, used = _with_processor(call)
        timings.append(timing)
        maps.append(map_of(found, mesh, target))
        processor.append(used)
    gc.unfreeze()
    return timings, maps, processor


def _other_maps(
    algorithm: Algorithm, mesh: TriangleMesh, maps: list[Complex | Fault], checked: Checked
) -> list[Fault]:
    """Return what is wrong with the first map that is not as good as the checked one."""
    judged = {checked.uv_hash}
    for number, uv in enumerate(maps, start=1):
        if isinstance(uv, Fault):
            wrong = [uv]
        elif hash_of(uv) in judged:
            continue
        else:
            judged.add(hash_of(uv))
            with _unruffled():
                wrong = faults(algorithm, mesh, uv)
                wrong = wrong or _other_energy(algorithm, mesh, uv, checked)
        if wrong:
            told = f"call {number} of {len(maps)} returned another map than the check"
            return [Fault(kind=FaultKind.OTHER_MAP, detail=told), *wrong]
    return []


def _other_energy(
    algorithm: Algorithm, mesh: TriangleMesh, uv: Complex, checked: Checked
) -> list[Fault]:
    if checked.relative_energy is None:
        return []
    if algorithm.target == "atlas":
        figures = atlas_metrics(mesh, uv.reshape(-1, 3))
        energy = figures["conformal_energy"] / figures["image_area"]
    else:
        area = image_area(mesh, uv)
        energy = (dirichlet_energy(mesh, uv) - area) / area
    if abs(energy - checked.relative_energy) <= SAME_ENERGY:
        return []
    told = f"E_C over the area is {energy:.9g}, not {checked.relative_energy:.9g}"
    return [Fault(kind=FaultKind.OTHER_ENERGY, detail=told)]


def _judged(
    algorithm: Algorithm, mesh: TriangleMesh, uv: Complex, extras: Mapping[str, Any]
) -> tuple[dict[str, Any], list[Fault]]:
    """Return what an outcome says of a map, and the faults."""
    with _unruffled():
        problems = faults(algorithm, mesh, uv)
        if algorithm.target == "atlas":
            metrics = atlas_metrics(mesh, uv.reshape(-1, 3))
            told = [] if problems else lost_in_rounding(metrics)
            finite = {name: _finite(v) for name, v in metrics.items()}
            return {"metrics": finite, "notes": tuple(told)}, problems
        metrics = all_metrics(mesh, uv)
        told = [] if problems else [*remarks(algorithm, mesh, uv), *lost_in_rounding(metrics)]
        if not problems:
            told += quality_notes(algorithm.target, mesh, uv, extras)
        about = {
            "metrics": {name: _finite(v) for name, v in metrics.items()},
            "boundaries": _boundaries(mesh, uv),
            "notes": tuple(told),
        }
    return about, problems


@contextmanager
def _unruffled() -> Iterator[None]:
    """Let no warning be an error: the algorithm may have made it one, for NumPy or for Python."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _no_metrics(error: Exception) -> Fault:
    told = f"its metrics cannot be computed: {said_by(error)}"
    return Fault(kind=FaultKind.NO_METRICS, detail=told)


def _changes(mesh: TriangleMesh, cell: Cell) -> list[Fault]:
    if mesh.fresh().hash == cell.mesh_hash:
        return []
    told = "the algorithm changed the mesh it was given"
    return [Fault(kind=FaultKind.MESH_CHANGED, detail=told)]


def _call(algorithm: Algorithm, mesh: TriangleMesh, cell: Cell) -> Call:
    arguments = algorithm.arguments(cell.parameters)
    if algorithm.program is not None:
        return ProgramCalls(algorithm, mesh, arguments, cell.threads)
    lacking = missing(algorithm)

    def call() -> tuple[Any, Timing]:
        if lacking:
            raise NotThere(lacking)
        fresh = mesh.fresh()
        return measure(lambda: algorithm.function(fresh, **arguments))

    return call


def _without_collector(call: Call) -> tuple[Any, Timing]:
    gc.collect()
    gc.disable()
    try:
        return call()
    finally:
        gc.enable()


def _with_processor(call: Call) -> tuple[Any, Timing, float]:
    """Call; the CPU seconds besides, of a program those of its process and what that started."""
    before = processor_now()
    found, timing = _without_collector(call)
    after = processor_now()
    if isinstance(call, ProgramCalls):
        return found, timing, after.others - before.others
    return found, timing, after.total - before.total


def _round(timings: list[Timing], used: Sequence[float] = ()) -> Round:
    middle = sorted(range(len(timings)), key=lambda k: timings[k].total)[(len(timings) - 1) // 2]
    calls = tuple(timing.total for timing in timings)
    processor = max(0.0, used[middle]) if used else None
    return Round(calls=calls, phases=timings[middle].phases, cpu_seconds=processor)


def _with_memory(outcome: Outcome, memory: Memory) -> Outcome:
    found = {"peak_memory_bytes": memory.peak, "memory_increase_bytes": memory.increase}
    return outcome.model_copy(update=found)


def _boundaries(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> tuple[Boundary, ...]:
    circles = boundary_circles(mesh, uv) if len(mesh.loops) > 1 else ()
    if not all(np.isfinite(circle.centre) for circle in circles):
        return ()
    return tuple(
        Boundary(
            vertex=circle.vertex,
            vertices=circle.vertices,
            centre=(circle.centre.real, circle.centre.imag),
            radius=_finite(circle.radius),
            circularity=_finite(circle.circularity),
        )
        for circle in circles
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
