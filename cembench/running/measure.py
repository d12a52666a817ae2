"""Measure one algorithm on one surface in this process.

Timed is the call alone, from the arrays V and F in memory to uv: the boundary loops, the Laplacian,
ordering, factorisation and iterations, and nothing else. An algorithm's word is not trusted: every
map, checked or timed, is judged (:mod:`cembench.running.judging`), in another process where there
is one, and the metrics are computed there.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.clock import Timing, measure
from cembench.core.errors import NotThere
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.linear_algebra.work import Work, counting
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import (
    Cell,
    Fault,
    FaultKind,
    LinearAlgebraWork,
    Outcome,
    ProgramRun,
    Round,
    not_ok,
)
from cembench.running.comparable import Used
from cembench.running.external.call import ProgramCalls
from cembench.running.external.present import library_version, missing
from cembench.running.judge import Promise
from cembench.running.judging import Checked, judged_calls, judged_check
from cembench.running.memory import Memory, memory_of_call
from cembench.running.motion import UNMOVED, moved
from cembench.running.processor import Processor, after_call, before_call
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
#: What the first call is called where it only warms up.
WARM_UP = "the warm-up"

Complex = NDArray[np.complex128]
Call = Callable[[TriangleMesh], tuple[Any, Timing]]


@dataclass
class TimedCalls:
    """The calls of one process in order, the first of which may only warm up."""

    is_warmed_up: bool = False
    motions: list[str] = field(default_factory=list)
    timings: list[Timing] = field(default_factory=list)
    #: The map of each as it was right after it.
    maps: list[Complex | Fault] = field(default_factory=list)
    #: CPU seconds when each began and ended.
    before: list[Processor] = field(default_factory=list)
    after: list[Processor] = field(default_factory=list)
    #: Whether a call changed the surface that it was given.
    changed: bool = False
    began: float = field(default_factory=monotonic)

    @property
    def timed(self) -> list[Timing]:
        """The calls that count."""
        return self.timings[self.is_warmed_up :]

    def names(self) -> list[str]:
        """Return what to call each."""
        count = len(self.timed)
        calls = [f"call {k} of {count}" for k in range(1, count + 1)]
        return [WARM_UP, *calls] if self.is_warmed_up else calls

    def used(self) -> Used:
        """Return what the calls that count used."""
        first = int(self.is_warmed_up)
        pairs = list(zip(self.before, self.after, strict=True))
        gaps = list(zip(self.after, self.before[1:], strict=False))
        return Used(
            wall=sum(t.total for t in self.timed),
            cold=self.timings[0].total if first else 0.0,
            own=sum(b.process - a.process for a, b in pairs[first:]),
            others=sum(b.others - a.others for a, b in pairs[first:]),
            beside=sum(b.beside - a.beside for a, b in gaps),
            disturbed=sum(b.running > 0 for b in self.before[1:]),
            looked=len(self.before) - 1,
            began=self.began,
            ended=monotonic(),
        )


def check_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell
) -> tuple[Outcome, Complex | None]:
    """Call once: is the result a valid map, and how much memory does the call take?

    Never raises for what the algorithm does: an exception, also one that would end the process, is
    a status with its cause. The one round of the outcome is this call, without warm-up. The second
    value is the map, also that of an invalid one if it has the right shape and is finite.
    """
    called, uv = call_cell(algorithm, mesh, cell)
    if uv is None:
        return called, None
    return judged_check(Promise.of(algorithm), mesh, called, uv), uv


def call_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell
) -> tuple[Outcome, Complex | None]:
    """Call once, as :func:`check_cell`, and leave the map to be judged by somebody else."""
    call = _call(algorithm, mesh, cell)
    program: dict[str, Any] = {}
    work: Work | None = None
    try:
        if isinstance(call, ProgramCalls):
            found, timing = call(mesh, watched=True)
            memory = Memory(call.peak, call.peak)
            program = _about_program(call)
        else:
            with linear_algebra(cell.solves, cell.backend), counting() as work:
                (found, timing), memory = memory_of_call(
                    lambda: _without_collector(lambda: call(mesh.fresh()))
                )
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
    problems = [*_changes(mesh, cell), *problems]
    outcome = not_ok("invalid", *problems) if problems else Outcome(status="ok")
    if work is not None:
        program["work"] = LinearAlgebraWork(**asdict(work))
    start = program.pop("start", None)
    described = report | program | {"uv_hash": hash_of(uv)}
    if seconds is None:
        described["rounds"] = (_program_round(_round([timing]), call, 1, start),)
    return _with_memory(outcome.model_copy(update=described), memory), uv


def time_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell, checked: Checked
) -> Round | Outcome:
    """Time calls on the surface as it is, and judge their maps here: see :func:`timed_calls`."""
    calls = timed_calls(algorithm, mesh, cell)
    if isinstance(calls, Outcome):
        return calls
    found, told = calls
    maps = [uv for uv in told.maps if not isinstance(uv, Fault)]
    named = list(zip(told.names(), told.motions, maps, strict=True))
    judged = judged_calls(Promise.of(algorithm), mesh, checked, named, {})
    if judged.faults:
        return not_ok("invalid", *judged.faults)
    return found.model_copy(update={"repeated": judged.repeated})


def timed_calls(
    algorithm: Algorithm,
    mesh: TriangleMesh,
    cell: Cell,
    motions: Sequence[str] = (),
    *,
    first_counts: bool = True,
) -> tuple[Round, TimedCalls] | Outcome:
    """Time a call, after one to warm up; several calls where they are short.

    A call of more than :data:`LONG_CALL` seconds is timed without a warm-up, if `first_counts`.
    Each call gets the surface in another motion; without `motions`, as it is. The maps are judged
    when all is timed. An outcome where the algorithm raised, or returned no map.
    """
    call = _call(algorithm, mesh, cell)
    try:
        with linear_algebra(cell.solves, cell.backend):
            told = _timed(call, mesh, algorithm.target, motions, first_counts=first_counts)
        timings = told.timed
        start = call.start_seconds(len(timings)) if isinstance(call, ProgramCalls) else None
    except BaseException as error:
        return outcome_of_error(error, mesh)
    problems = [fault for t in timings if (fault := phases_fault(t))][:1]
    for name, uv in zip(told.names(), told.maps, strict=True):
        if isinstance(uv, Fault):
            words = f"{name} returned another map than the check"
            problems += [Fault(kind=FaultKind.OTHER_MAP, detail=words), uv]
            break
    problems += [_changed()] if told.changed else _changes(mesh, cell)
    if not problems and min(t.total for t in told.timings) <= 0:
        words = "its times cannot be: a call took no time, or less"
        problems.append(Fault(kind=FaultKind.IMPOSSIBLE_TIMES, detail=words))
    if problems:
        return not_ok("invalid", *problems)
    first = len(told.timings) - len(timings)
    found = _round(timings, told.before[first:], told.after[first:], isinstance(call, ProgramCalls))
    cold = told.timings[0].total if told.is_warmed_up else None
    found = _program_round(found, call, len(timings), start)
    return found.model_copy(update={"cold_seconds": cold}), told


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
    call: Call, mesh: TriangleMesh, target: str, motions: Sequence[str], *, first_counts: bool
) -> TimedCalls:
    """Call, and note what came out and what it took."""
    told = TimedCalls()

    def once() -> None:
        number = len(told.timings)
        motion = motions[number] if motions else UNMOVED
        given = moved(mesh, motion)
        gc.collect()
        gc.disable()
        try:
            told.before.append(before_call())
            found, timing = call(given)
            told.after.append(after_call())
        finally:
            gc.enable()
        told.motions.append(motion)
        told.timings.append(timing)
        told.maps.append(map_of(found, given, target))
        told.changed |= not _is_as(given, moved(mesh, motion))

    once()
    if told.timings[0].total > LONG_CALL and first_counts:
        return told
    told.is_warmed_up = True
    gc.collect()
    gc.freeze()  # collecting again looks at what is new, and leaves the rest out of the caches
    while len(told.timed) < ENOUGH_CALLS and sum(t.total for t in told.timed) < ENOUGH_SECONDS:
        once()
    gc.unfreeze()
    return told


def _is_as(mesh: TriangleMesh, other: TriangleMesh) -> bool:
    return np.array_equal(mesh.V, other.V) and np.array_equal(mesh.F, other.F)


def _changes(mesh: TriangleMesh, cell: Cell) -> list[Fault]:
    return [] if mesh.fresh().hash == cell.mesh_hash else [_changed()]


def _changed() -> Fault:
    told = "the algorithm changed the mesh it was given"
    return Fault(kind=FaultKind.MESH_CHANGED, detail=told)


def _call(algorithm: Algorithm, mesh: TriangleMesh, cell: Cell) -> Call:
    arguments = algorithm.arguments(cell.parameters)
    if algorithm.program is not None:
        return ProgramCalls(algorithm, mesh, arguments, cell.threads)
    lacking = missing(algorithm)

    def call(given: TriangleMesh) -> tuple[Any, Timing]:
        if lacking:
            raise NotThere(lacking)
        return measure(lambda: _read(algorithm.function(given, **arguments)))

    return call


def _read(found: Any) -> Any:
    """Return what an algorithm returned, its map looked at: what it puts off is its time too."""
    with suppress(BaseException):  # told when the result is taken apart
        _ = found.uv
    with suppress(BaseException):
        _ = found.corners
    return found


def _without_collector(call: Callable[[], tuple[Any, Timing]]) -> tuple[Any, Timing]:
    gc.collect()
    gc.disable()
    try:
        return call()
    finally:
        gc.enable()


def _round(
    timings: Sequence[Timing],
    before: Sequence[Processor] = (),
    after: Sequence[Processor] = (),
    is_program: bool = False,
) -> Round:
    middle = sorted(range(len(timings)), key=lambda k: timings[k].total)[(len(timings) - 1) // 2]
    calls = tuple(timing.total for timing in timings)
    used = None
    if before:
        a, b = before[middle], after[middle]
        used = max(0.0, b.others - a.others if is_program else b.total - a.total)
    return Round(calls=calls, phases=timings[middle].phases, cpu_seconds=used)


def _with_memory(outcome: Outcome, memory: Memory) -> Outcome:
    found = {"peak_memory_bytes": memory.peak, "memory_increase_bytes": memory.increase}
    return outcome.model_copy(update=found)
