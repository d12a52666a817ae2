"""Are the seconds of a process's calls figures that others' can be compared with?

Decided where the algorithm was never imported, from what its process told: the CPU seconds of its
calls against their wall clock, and the times against the clock of the process that started it.
"""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel

from cembench.results.records import Fault, FaultKind, Round, lower_median

#: How much more CPU time than wall clock, per thread, a clock's grain explains: a share, and
#: seconds of a round. Of other processes the system counts in hundredths of a second.
MORE, GRAIN, GRAIN_OF_OTHERS = 0.1, 0.002, 0.02
#: CPU seconds beside the calls, as a share of the calls and absolute, that nobody minds.
BESIDE, LITTLE = 0.05, 0.005
#: In how many looks, and in which share of them, more threads may be seen running than allowed.
MOST_CROWDED, CROWDED = 2, 0.2
#: By how much two processes may read the same clock differently, in seconds.
CLOCKS_APART = 0.05
#: A first call is far above the later ones at so many times their seconds, and so many more.
COLD_TIMES, COLD_SECONDS = 3.0, 0.1


class Used(BaseModel):
    """What the timed calls of a process used, as it told itself."""

    #: Wall-clock seconds of the timed calls together; and that of the first call, if it warmed up.
    wall: float
    cold: float = 0.0
    #: CPU seconds in these calls: of all threads of the process, and of what it has started.
    own: float = 0.0
    others: float = 0.0
    #: CPU seconds between the calls, of all but the thread that calls.
    beside: float = 0.0
    #: Before how many of the later calls something else was running, of so many looks.
    disturbed: int = 0
    looked: int = 0
    #: When it began and ended, on the clock that does not go back and that all processes share.
    began: float = 0.0
    ended: float = 0.0


def incomparable(used: Used, running: Sequence[int], threads: int) -> list[Fault]:
    """Return why calls with so many threads cannot be compared with others' calls.

    `running` is how many threads of the process and what it started were running, or waiting for a
    processor, each time somebody looked: on a busy machine CPU time does not tell.
    """
    found = []
    grain = GRAIN + (GRAIN_OF_OTHERS if used.others else 0.0)
    spent = used.own + used.others
    if spent > threads * (1 + MORE) * used.wall + grain:
        told = (
            f"the timed calls used {spent:.3g} s of CPU time in {used.wall:.3g} s: "
            f"{spent / used.wall:.1f} cores where --threads {threads} allows {threads}. Measure "
            "it with as many threads, or let it start none"
        )
        found.append(Fault(kind=FaultKind.MORE_CORES, detail=told))
    crowded = [count for count in running if count > threads]
    if not found and len(crowded) >= MOST_CROWDED and len(crowded) > CROWDED * len(running):
        told = (
            f"{max(crowded)} threads or processes were running at a time, in {len(crowded)} of "
            f"{len(running)} looks, where --threads {threads} allows {threads}. Measure it with as "
            "many threads, or let it start none"
        )
        found.append(Fault(kind=FaultKind.MORE_CORES, detail=told))
    # With several threads a library's pool waits for its next work by spinning.
    much = used.beside > BESIDE * used.wall + LITTLE + grain - GRAIN
    often = used.disturbed > 1 and 2 * used.disturbed > used.looked
    if threads == 1 and (much or often):
        told = (
            f"something went on working between the timed calls: {used.beside:.3g} s of CPU time "
            f"beside {used.wall:.3g} s of calls, running before {used.disturbed} of {used.looked}. "
            "All work on a map belongs into the call"
        )
        found.append(Fault(kind=FaultKind.WORKS_AHEAD, detail=told))
    return found


def impossible(used: Used, found: Round, began: float, ended: float) -> list[Fault]:
    """Return what cannot be about a process's times, seen by the one that started and ended it."""
    told = used.cold + used.wall
    if min(found.calls) <= 0 or used.cold < 0 or min(used.own, used.others) < 0:
        why = "a call took no time, or less"
    elif told > used.ended - used.began + CLOCKS_APART:
        why = f"calls of {told:.3g} s in a process of {used.ended - used.began:.3g} s"
    elif used.began < began - CLOCKS_APART or used.ended > ended + CLOCKS_APART:
        why = "it says that it ran when it did not"
    else:
        return []
    return [Fault(kind=FaultKind.IMPOSSIBLE_TIMES, detail=f"its times cannot be: {why}")]


def is_cold(rounds: Sequence[Round]) -> tuple[float, float] | None:
    """Return the first and the later calls' seconds where the first is far above; else None."""
    cold = [r.cold_seconds for r in rounds if r.cold_seconds is not None]
    if not cold:
        return None
    first, later = lower_median(cold), lower_median([r.seconds for r in rounds])
    far = first > COLD_TIMES * later and first - later > COLD_SECONDS
    return (first, later) if far else None
