"""Whether the seconds of a process's calls are comparable with those of others.

This is decided in a process that never imports the algorithm, from what the measured process
reported: CPU seconds are compared with wall-clock seconds, and all times with the clock of the
parent process.
"""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel

from cembench.results.records import Fault, FaultKind, Round, lower_median

#: Tolerance of CPU time over wall-clock time, per thread, for the resolution of clocks: a share,
#: and seconds of a round. The CPU time of other processes is counted in hundredths of a second.
MORE, GRAIN, GRAIN_OF_OTHERS = 0.1, 0.002, 0.02
#: Tolerated CPU seconds of all but the calling thread, between or within the calls: a share of the
#: calls, and absolute. A thread that ends its work or wakes at times is no work ahead and no help.
BESIDE, LITTLE = 0.05, 0.005
#: Tolerated CPU seconds of the calling thread between the calls: a share of the calls, for garbage
#: that they leave to the collector, and a multiple of what preparing a call takes.
LEFT, PREPARING = 0.5, 3.0
#: Looks, as a number and a share, that find more threads running than allowed: at least so many,
#: and more than that share. A program and what starts it run side by side for a moment, which one
#: look in forty meets; a call of a few hundredths of a second has seven.
MIN_CROWDED, CROWDED = 4, 0.2
#: Tolerated difference between two processes reading the same clock, in seconds, and CPU seconds
#: that the system may have beyond those that a process reports, for its end; MORE is their share.
CLOCKS_APART, ENDING = 0.05, 0.05
#: A first call is much slower than later ones above this factor and this difference in seconds.
COLD_TIMES, COLD_SECONDS = 3.0, 0.1


class Used(BaseModel):
    """Resources that the timed calls of a process used, as reported by it."""

    #: Total wall-clock seconds of the timed calls, and those of the warm-up call, if any.
    wall: float
    cold: float = 0.0
    #: CPU seconds in these calls: of all threads of the process, and of its children.
    own: float = 0.0
    others: float = 0.0
    #: CPU seconds in these calls, of all threads except the calling one.
    helping: float = 0.0
    #: CPU seconds between the calls, of all threads except the calling one, without those with
    #: which processes start.
    beside: float = 0.0
    #: CPU seconds between the calls of the calling thread, without those of the looks at other
    #: processes, and what preparing as many calls took before the algorithm was loaded.
    between: float = 0.0
    preparing: float = 0.0
    #: Number of later calls before which something else was running, and number of looks.
    disturbed: int = 0
    looked: int = 0
    #: CPU seconds of the whole process and its children.
    everything: float = 0.0
    #: Begin and end on the monotonic clock that all processes share.
    began: float = 0.0
    ended: float = 0.0


def incomparable(used: Used, running: Sequence[int], threads: int) -> list[Fault]:
    """Return why the calls cannot be compared with others' calls; empty if they can.

    `threads` is the allowed number of threads. `running` is, for each look, the number of threads
    of the process and its children that were running or waiting for a processor: on a busy machine,
    CPU time alone does not show them.
    """
    reasons = []
    grain = GRAIN + (GRAIN_OF_OTHERS if used.others else 0.0)
    spent = used.own + used.others
    if spent > threads * (1 + MORE) * used.wall + grain:
        message = (
            f"the timed calls used {spent:.3g} s of CPU time in {used.wall:.3g} s: "
            f"{spent / used.wall:.1f} cores, but {threads} may be used. Allow more threads, or "
            "make the algorithm start none"
        )
        reasons.append(Fault(kind=FaultKind.MORE_CORES, detail=message))
    crowded = [count for count in running if count > threads]
    often = len(crowded) >= MIN_CROWDED and len(crowded) > CROWDED * len(running)
    if not reasons and often and used.helping > BESIDE * used.wall + LITTLE:
        message = (
            f"{max(crowded)} threads or processes were running at the same time, in "
            f"{len(crowded)} of {len(running)} samples, but {threads} may be used. Allow more "
            "threads, or make the algorithm start none"
        )
        reasons.append(Fault(kind=FaultKind.MORE_CORES, detail=message))
    # With several threads, a library's idle thread pool may spin.
    much = used.beside > BESIDE * used.wall + LITTLE + grain - GRAIN
    before = 2 * used.disturbed > max(used.looked, 2) and used.beside > BESIDE * used.between
    # In CPU seconds, as `between` is: calls take longer on a busy machine, what follows them too.
    late = used.between > LEFT * (used.cold + used.own) + PREPARING * used.preparing + LITTLE
    if late:
        message = (
            f"work went on between the timed calls: {used.between:.3g} s of CPU time in the "
            f"calling thread, of which preparing the calls explains {used.preparing:.3g} s. All "
            "work on a map must be done within the call, and none by a finaliser, a callback of "
            "the garbage collector or a signal handler; if the call leaves much garbage, end it "
            "with gc.collect()"
        )
        reasons.append(Fault(kind=FaultKind.WORKS_AHEAD, detail=message))
    elif threads == 1 and (much or before):
        message = (
            f"work went on between the timed calls: {used.beside:.3g} s of CPU time "
            f"besides {used.wall:.3g} s of calls, before {used.disturbed} of {used.looked} calls. "
            "All work on a map must be done within the call"
        )
        reasons.append(Fault(kind=FaultKind.WORKS_AHEAD, detail=message))
    return reasons


def impossible(
    used: Used, measured: Round, began: float, ended: float, cpu: float = 0.0
) -> list[Fault]:
    """Return a fault if a process's times contradict its parent's clock, or the system's."""
    reported = used.cold + used.wall
    if min(measured.calls) <= 0 or used.cold < 0 or min(used.own, used.others) < 0:
        why = "a call took no time or negative time"
    elif reported > used.ended - used.began + CLOCKS_APART:
        why = f"calls of {reported:.3g} s in a process of {used.ended - used.began:.3g} s"
    elif used.began < began - CLOCKS_APART or used.ended > ended + CLOCKS_APART:
        why = "it reports times when it was not running"
    elif cpu > (1 + MORE) * used.everything + ENDING:
        why = f"it reports {used.everything:.3g} s of CPU time, and the system {cpu:.3g} s"
    else:
        return []
    return [Fault(kind=FaultKind.IMPOSSIBLE_TIMES, detail=f"its times are impossible: {why}")]


def is_cold(rounds: Sequence[Round]) -> tuple[float, float] | None:
    """Return the seconds of first and later calls if the first are much slower, else None."""
    cold = [r.cold_seconds for r in rounds if r.cold_seconds is not None]
    if not cold:
        return None
    first, later = lower_median(cold), lower_median([r.seconds for r in rounds])
    far = first > COLD_TIMES * later and first - later > COLD_SECONDS
    return (first, later) if far else None
