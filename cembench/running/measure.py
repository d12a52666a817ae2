"""Measure one algorithm on one surface in this process.

Only the call is timed, from the arrays V and F in memory to uv: boundary loops, Laplacian,
ordering, factorisation and iterations. The algorithm is not trusted: every map, checked or timed,
is judged (:mod:`cembench.running.map_checks`), in another process if possible, and the metrics are
computed there.
"""

from __future__ import annotations

import gc
import math
import random
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import pairwise
from time import monotonic, thread_time
from typing import Any

import numpy as np

from cembench.core.arrays import Complex
from cembench.core.clock import Timing, measure
from cembench.core.errors import NotThere, ParameterError
from cembench.core.parameterization import Parameterization
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
from cembench.running.external.call import ProgramCalls
from cembench.running.external.exchange import read_map
from cembench.running.external.installed import library_version, missing
from cembench.running.map_checks import SECOND_CALL, WARM_UP, judged_check
from cembench.running.map_promises import Promise
from cembench.running.memory import Memory, memory_of_call
from cembench.running.processor import Processor, after_call, before_call
from cembench.running.quality import better_parameters
from cembench.running.relay import RELAYS
from cembench.running.rigid_motion import UNMOVED, drawn, moved
from cembench.running.sanitized_result import (
    Returned,
    finite,
    hash_of,
    outcome_of_error,
    phases_fault,
    report_of,
)
from cembench.running.timing_checks import Used

#: A process times further calls up to this total of seconds, or this number of calls.
ENOUGH_SECONDS = 0.3
ENOUGH_CALLS = 20
#: A first call longer than this, in seconds, is not repeated: a warm-up saves only tenths of one.
LONG_CALL = 5.0

#: In place of a map that is kept elsewhere.
_NOT_KEPT = np.empty(0, dtype=np.complex128)

Call = Callable[[TriangleMesh], tuple[Returned, Timing]]


@dataclass(frozen=True)
class TimedCall:
    """A call of a process, with its map and its times."""

    motion: str
    timing: Timing
    #: The map, copied while the clock ran.
    uv: Complex | Fault
    #: CPU seconds at the begin and end of the call.
    before: Processor
    after: Processor
    #: Whether it counts; a call that warms up does not.
    counts: bool = True


@dataclass
class TimedCalls:
    """The calls of one process, in order, of one algorithm or of several."""

    calls: list[TimedCall] = field(default_factory=list)
    #: Whether a call changed the given surface.
    changed: bool = False
    began: float = field(default_factory=monotonic)
    start: Processor = field(default_factory=after_call)

    @property
    def counted(self) -> list[TimedCall]:
        """The timed calls."""
        return [call for call in self.calls if call.counts]

    @property
    def seconds(self) -> float:
        """The seconds of the timed calls."""
        return sum(call.timing.total for call in self.counted)

    def names(self) -> list[str]:
        """Return the names of the calls of one algorithm."""
        count = len(self.counted)
        calls = [f"call {k} of {count}" for k in range(1, count + 1)]
        return [*(WARM_UP, SECOND_CALL)[: len(self.calls) - count], *calls]

    def used(self, preparing: float = 0.0) -> Used:
        """Return the resources used by the timed calls, and between all calls.

        `preparing` is what it took to prepare a call before the algorithm was loaded.
        """
        calls, counted = self.calls, self.counted
        first = calls[0]
        gaps = [(a.after, b.before) for a, b in pairwise(calls)]
        alone = [(self.start, first.before), *gaps] if first.counts else gaps
        return Used(
            wall=self.seconds,
            cold=sum(call.timing.total for call in calls if not call.counts),
            between=sum(b.thread - b.looking - a.thread - a.looking for a, b in alone),
            preparing=preparing * len(alone),
            own=sum(call.after.process - call.before.process for call in counted),
            others=sum(call.after.others - call.before.others for call in counted),
            helping=sum(call.after.beside - call.before.beside for call in counted),
            beside=sum(b.beside - a.beside - b.starts_since(a) for a, b in gaps),
            disturbed=sum(call.before.running > 0 for call in calls[1:]),
            looked=len(calls) - 1,
            began=self.began,
            ended=monotonic(),
        )


@dataclass(frozen=True)
class Timed:
    """What is timed in a process: an algorithm, its cell, and the motions of its calls.

    The first `untimed` calls are not timed: a warm-up, and perhaps another one. With
    `first_counts`, a first call of more than :data:`LONG_CALL` seconds is timed, and no other.
    Without `motions` the surface is not moved; what they leave open is drawn as a call begins.
    """

    algorithm: Algorithm
    cell: Cell
    motions: Sequence[str] = ()
    first_counts: bool = True
    untimed: int = 1


def check_cell(
    algorithm: Algorithm,
    mesh: TriangleMesh,
    cell: Cell,
    *,
    memory: bool = True,
    figures: bool = True,
) -> tuple[Outcome, Complex | None]:
    """Call once, judge the map, and measure the memory of the call.

    Without `memory`, in a process that has other work too, memory is neither measured nor tidied
    up. Without `figures` the map is searched for faults alone: no metrics, no remarks.

    This never raises because of the algorithm: an exception, even one that would end the process,
    becomes a status with its cause. The only round of the outcome is this call, without a warm-up.
    The second value is the map; an invalid one too, if it has the right shape and is finite.

    What a handler of signals raises, such as KeyboardInterrupt for Ctrl-C, is raised.
    """
    with _raised_by_signals() as raised:
        called, uv = call_cell(algorithm, mesh, cell, memory=memory)
    if raised:
        raise raised[0]
    if uv is None:
        return called, None
    return judged_check(Promise.of(algorithm), mesh, called, uv, figures=figures), uv


def check_overlay(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell, *, figures: bool = True
) -> tuple[Outcome, TriangleMesh, Complex | None]:
    """Call an algorithm's refinement once, like :func:`check_cell`; also return the refined mesh.

    Its map is judged on the refined mesh. Without a map, the mesh is the given one.
    """
    refined: list[Any] = []

    def at_given_vertices(mesh: TriangleMesh, **parameters: Any) -> Parameterization:
        refined.append(refinement_of(algorithm)(mesh, **parameters))
        return Parameterization(refined[-1].uv[: mesh.n].copy(), extras=refined[-1].extras)

    with _raised_by_signals() as raised:
        unrefined = replace(algorithm, function=at_given_vertices)
        called, z = call_cell(unrefined, mesh, cell, memory=False)
    if raised:
        raise raised[0]
    if z is None:
        return called, mesh, None
    fine, uv = refined[0].mesh, refined[0].uv
    return judged_check(Promise.of(algorithm), fine, called, uv, figures=figures), fine, uv


def refinement_of(algorithm: Algorithm) -> Callable[..., Any]:
    """Return what maps a surface on a refinement of it.

    Raises
    ------
    ParameterError
        The algorithm has no such map.
    """
    if algorithm.refinement is None:
        raise ParameterError(
            f"{algorithm.name} has no `overlay`, its map is on the surface's own triangles; use "
            "algorithm='cetm-flips'."
        )
    return algorithm.refinement


@contextmanager
def _raised_by_signals() -> Iterator[list[BaseException]]:
    """Yield a list of the exceptions raised by signal handlers, not by the algorithm."""
    raised: list[BaseException] = []
    handlers: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # where signals arrive
        handlers = {number: signal.getsignal(number) for number in signal.valid_signals()}
        handlers = {
            number: _noting(one, raised) for number, one in handlers.items() if callable(one)
        }
    before = {number: signal.signal(number, one) for number, one in handlers.items()}
    try:
        yield raised
    finally:
        for number, one in before.items():
            if signal.getsignal(number) is handlers[number]:  # else a handler chose another
                signal.signal(number, one)


def _noting(handler: Any, raised: list[BaseException]) -> Callable[[int, Any], Any]:
    def handle(number: int, frame: Any) -> Any:
        try:
            return handler(number, frame)
        except BaseException as error:
            raised.append(error)
            raise

    return handle


def call_cell(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell, *, memory: bool = True
) -> tuple[Outcome, Complex | None]:
    """Call once, like :func:`check_cell`, but leave the map to be judged elsewhere.

    If the algorithm suggests other parameters (``alternative`` in its extras), these are tried
    after the measured call, and a notice says so where they are much better.
    """
    called, uv = _called(algorithm, mesh, cell, memory=memory)
    suggested = called.extras.get("alternative")
    if uv is None or algorithm.target == "atlas" or not isinstance(suggested, dict):
        return called, uv
    other = cell.model_copy(update={"parameters": cell.parameters | suggested})
    try:
        other_uv = _called(algorithm, mesh, other, memory=memory)[1]
    except ParameterError:  # these are no parameters of the algorithm
        other_uv = None
    if other_uv is None:
        return called, uv
    better = better_parameters(algorithm.name, mesh, uv, other_uv, suggested)
    return called.model_copy(update={"notes": (*called.notes, *better)}), uv


def _called(
    algorithm: Algorithm, mesh: TriangleMesh, cell: Cell, *, memory: bool
) -> tuple[Outcome, Complex | None]:
    """Call once, and return the outcome without a judgement, and the map."""
    call = _call(algorithm, mesh, cell)
    program: dict[str, Any] = {}
    work: Work | None = None
    try:
        if isinstance(call, ProgramCalls):
            returned, timing = call(mesh, watched=True)
            used = Memory(call.peak, call.peak)
            program = _about_program(call)
        else:
            with linear_algebra(cell.solves, cell.backend), counting() as work:
                # Else the memory is of another process, or what reading a file takes.
                ours = cell.algorithm not in RELAYS and algorithm.maps is None
                measured = memory_of_call if memory and ours else _without_memory
                (returned, timing), used = measured(
                    lambda: _without_collector(lambda: call(mesh.fresh()))
                )
    except BaseException as error:
        return outcome_of_error(error, mesh), None
    if algorithm.library is not None:
        program = {"program": ProgramRun(version=library_version(algorithm.library))}
    if algorithm.maps is not None:
        program, work = {"iterations": None}, None
    uv = finite(returned.uv, algorithm.target)
    if isinstance(uv, Fault):
        return _with_memory(not_ok("invalid", uv).model_copy(update=program), used), None
    report, problems = report_of(returned.result)
    seconds = phases_fault(timing)
    problems += [seconds] if seconds else []
    problems = [*_changes(mesh, cell), *problems]
    outcome = not_ok("invalid", *problems) if problems else Outcome(status="ok")
    if work is not None:
        program["work"] = LinearAlgebraWork(**asdict(work))
    start = program.pop("start", None)
    described = report | program | {"uv_hash": hash_of(uv)}
    if seconds is None and algorithm.maps is None:
        described["rounds"] = (_program_round(_round([timing]), call, 1, start),)
    return _with_memory(outcome.model_copy(update=described), used), uv


def timed_together(
    mesh: TriangleMesh, cells: Sequence[Timed]
) -> tuple[list[tuple[Round, TimedCalls]], TimedCalls] | Outcome:
    """Time a call of each algorithm after a warm-up, or several calls if they are short.

    First come the calls that are not timed, then those that are, each in random order: as many of
    each algorithm as it has in a process of its own. Each call gets the surface in a different
    motion. Returns the round and the calls of each, and the calls of all in their order; or an
    outcome if one raised or returned no map. The maps are judged later.
    """
    first = cells[0].cell
    try:
        made = [_call(one.algorithm, mesh, one.cell) for one in cells]
        with linear_algebra(first.solves, first.backend):
            by_cell, everything = _timed(list(zip(cells, made, strict=True)), mesh)
        rounds = [
            _round_of(one, call, t, mesh) for one, call, t in zip(cells, made, by_cell, strict=True)
        ]
    except BaseException as error:
        return outcome_of_error(error, mesh)
    results = []
    for measured, calls in zip(rounds, by_cell, strict=True):
        if isinstance(measured, Outcome):
            return measured
        results.append((measured, calls))
    return results, everything


def _round_of(one: Timed, call: Call, timed: TimedCalls, mesh: TriangleMesh) -> Round | Outcome:
    """Return the figures of an algorithm's calls, or an outcome that says what is wrong."""
    counted = timed.counted
    timings = [c.timing for c in counted]
    start = call.start_seconds(len(timings)) if isinstance(call, ProgramCalls) else None
    problems = [fault for t in timings if (fault := phases_fault(t))][:1]
    for name, made in zip(timed.names(), timed.calls, strict=True):
        if isinstance(made.uv, Fault):
            message = f"{name} returned a different map from the check"
            problems += [Fault(kind=FaultKind.OTHER_MAP, detail=message), made.uv]
            break
    problems += [_changed()] if timed.changed else _changes(mesh, one.cell)
    if not problems and min(c.timing.total for c in timed.calls) <= 0:
        message = "its times are impossible: a call took no time or negative time"
        problems.append(Fault(kind=FaultKind.IMPOSSIBLE_TIMES, detail=message))
    if problems:
        return not_ok("invalid", *problems)
    before, after = [c.before for c in counted], [c.after for c in counted]
    result = _round(timings, before, after, isinstance(call, ProgramCalls))
    cold = None if timed.calls[0].counts else timed.calls[0].timing.total
    result = _program_round(result, call, len(timings), start)
    return result.model_copy(update={"cold_seconds": cold})


def _about_program(call: ProgramCalls) -> dict[str, Any]:
    """Return the fields of an outcome for a program, whose iterations are unknown."""
    start = call.start_seconds(1)
    about = {"program": call.facts(), "notes": call.notices(start), "start": start}
    return about | {"iterations": None}


def _program_round(measured: Round, call: Call, calls: int, start: float | None) -> Round:
    """Return a round with the additional times of an external program's process."""
    if not isinstance(call, ProgramCalls):
        return measured
    own = call.own_seconds(calls)
    return measured.model_copy(update={"start_seconds": start, "own_seconds": own})


def _timed(
    cells: Sequence[tuple[Timed, Call]], mesh: TriangleMesh
) -> tuple[list[TimedCalls], TimedCalls]:
    """Make the calls; return those of each cell, and all of them in their order."""
    by_cell, everything = [TimedCalls() for _ in cells], TimedCalls()

    def once(number: int, *, counts: bool) -> None:
        (one, call), mine = cells[number], by_cell[number]
        gc.collect()
        gc.disable()
        try:
            # Made after the collection, so that no finaliser or callback could see it.
            motion = drawn(one.motions[len(mine.calls)]) if one.motions else UNMOVED
            surface = moved(mesh, motion)
            before = before_call()
            returned, timing = call(surface)
            after = after_call(before)
        finally:
            gc.enable()
        uv = finite(returned.uv, one.algorithm.target)
        counts = counts or (timing.total > LONG_CALL and one.first_counts and not mine.calls)
        made = TimedCall(motion, timing, uv, before, after, counts)
        mine.calls.append(made)
        everything.calls.append(replace(made, uv=_NOT_KEPT))
        mine.changed |= not _is_as(surface, moved(mesh, motion))

    numbers = _shuffled(range(len(cells)))
    for number in numbers:
        once(number, counts=False)
    short = [number for number in numbers if not by_cell[number].counted]
    if not short:
        return by_cell, everything
    gc.collect()
    gc.freeze()  # a second collection scans only new objects; the others stay out of the caches
    for number in short:
        while len(by_cell[number].calls) < cells[number][0].untimed:
            once(number, counts=False)
    if len(cells) == 1:
        timed = by_cell[0]
        while len(timed.counted) < ENOUGH_CALLS and timed.seconds < ENOUGH_SECONDS:
            once(0, counts=True)
    else:
        for number in _shuffled([n for n in short for _ in range(_calls_expected(by_cell[n]))]):
            once(number, counts=True)
    gc.unfreeze()
    return by_cell, everything


def _calls_expected(timed: TimedCalls) -> int:
    """Return how many calls there would be in a process of its own, by the last call so far."""
    last = max(timed.calls[-1].timing.total, ENOUGH_SECONDS / ENOUGH_CALLS)
    return math.ceil(ENOUGH_SECONDS / last)


def _shuffled(numbers: Sequence[int]) -> list[int]:
    return random.SystemRandom().sample(numbers, len(numbers))


def preparing_seconds(mesh: TriangleMesh) -> float:
    """Return the CPU seconds that it takes to prepare a call, in this thread.

    Called before an algorithm is loaded: what takes more between the calls is its work.
    """

    def once() -> float:
        begun = thread_time()
        gc.collect()
        surface = moved(mesh, "preparing")
        _is_as(surface, moved(mesh, "preparing"))
        return thread_time() - begun

    return min(once(), once())  # the first one also loads what it needs


def _is_as(mesh: TriangleMesh, other: TriangleMesh) -> bool:
    return np.array_equal(mesh.V, other.V) and np.array_equal(mesh.F, other.F)


def _changes(mesh: TriangleMesh, cell: Cell) -> list[Fault]:
    return [] if mesh.fresh().hash == cell.mesh_hash else [_changed()]


def _changed() -> Fault:
    message = "the algorithm changed the mesh it was given"
    return Fault(kind=FaultKind.MESH_CHANGED, detail=message)


def _call(algorithm: Algorithm, mesh: TriangleMesh, cell: Cell) -> Call:
    arguments = algorithm.arguments(cell.parameters)
    if algorithm.program is not None:
        return ProgramCalls(algorithm, mesh, arguments, cell.threads)
    lacking = missing(algorithm)
    function = algorithm.function if algorithm.maps is None else partial(read_map, algorithm)

    def call(surface: TriangleMesh) -> tuple[Returned, Timing]:
        if lacking:
            raise NotThere(lacking)
        return measure(
            lambda: Returned.of(function(surface, **arguments), surface, algorithm.target)
        )

    return call


def _without_collector(call: Callable[[], tuple[Returned, Timing]]) -> tuple[Returned, Timing]:
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        return call()
    finally:
        if was_enabled:
            gc.enable()


def _without_memory(
    call: Callable[[], tuple[Returned, Timing]],
) -> tuple[tuple[Returned, Timing], Memory]:
    return call(), Memory(None, None)


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
    figures = {"peak_memory_bytes": memory.peak, "memory_increase_bytes": memory.increase}
    return outcome.model_copy(update=figures)
