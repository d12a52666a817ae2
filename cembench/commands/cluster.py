"""Runs on a cluster: what they are expected to take."""

from __future__ import annotations

import heapq
from bisect import bisect_left
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cembench.commands.console import out

if TYPE_CHECKING:
    from cembench.running.estimate import Estimate
    from cembench.running.plan import Task

#: For so many machines hours are estimated.
ESTIMATED_FOR = (1, 10, 100)


def hours(
    tasks: Sequence[Task], costs: Sequence[Estimate | None], budget: float | None
) -> dict[str, Any]:
    """Return the hours that so many machines would take, and what limits them.

    Returns
    -------
    dict
        ``seconds`` by number of machines; ``units``, how many there are; ``useful``, how many
        machines are of use at most; ``longest``, the surface whose unit takes longest, and its
        seconds.
    """
    from cembench.running.estimate import planned_seconds
    from cembench.running.plan import comparable_groups

    known = {id(task): cost for task, cost in zip(tasks, costs, strict=True) if cost is not None}
    groups = comparable_groups([task for task in tasks if id(task) in known])
    units = [[known[id(task)] for task in group] for group in groups]
    whole = [sum(cost.seconds for cost in unit) for unit in units]
    by_machines: dict[int, float] = {}
    seconds: list[float] = []
    for machines in ESTIMATED_FOR:
        share = None if budget is None else budget * machines / (sum(whole) or 1.0)
        seconds = [
            planned_seconds(unit, None if share is None else share * alone)
            for unit, alone in zip(units, whole, strict=True)
        ]
        by_machines[machines] = makespan(seconds, machines)
    longest = max(range(len(units)), key=seconds.__getitem__, default=None)
    return {
        "seconds": by_machines,
        "units": len(units),
        "useful": most_useful(seconds),
        "longest": None if longest is None else groups[longest][0].cell.mesh,
        "longest_seconds": None if longest is None else seconds[longest],
    }


def makespan(seconds: Sequence[float], machines: int) -> float:
    """Return the seconds that `machines` machines take for all units, longest first.

    >>> makespan([3.0, 2.0, 2.0], 2)
    4.0
    """
    free = [0.0] * machines
    for one in sorted(seconds, reverse=True):
        heapq.heappush(free, heapq.heappop(free) + one)
    return max(free)


def most_useful(seconds: Sequence[float]) -> int:
    """Return the number of machines beyond which the run takes as long as its longest unit.

    Differences below 1 % are ignored.

    >>> most_useful([3.0, 2.0, 1.0])
    2
    """
    longest = max(seconds, default=0.0)
    numbers = range(1, len(seconds))
    enough = bisect_left(numbers, True, key=lambda n: makespan(seconds, n) <= 1.01 * longest)
    return min(len(seconds), 1 + enough)


def show_hours(estimate: dict[str, Any]) -> None:
    """Print what :func:`hours` found."""
    from cembench.commands.progress import duration

    if not estimate["units"]:
        return
    out.print("\nOn a cluster, where a surface under a policy is one machine's as a whole:")
    for machines, seconds in estimate["seconds"].items():
        limited = machines > 1 and seconds <= 1.01 * estimate["longest_seconds"]
        limit = f", as long as {estimate['longest']} takes" if limited else ""
        name = "machine " if machines == 1 else "machines"
        out.print(f"{machines:>6} {name}  about {duration(seconds)}{limit}", soft_wrap=True)
    longest, useful = duration(estimate["longest_seconds"]), f"{estimate['useful']:,}"
    most = (
        f"more than {useful} machines gain nothing" if estimate["useful"] > 1 else "one is enough"
    )
    out.print(f"The longest of {estimate['units']:,} takes about {longest}: {most}", soft_wrap=True)
