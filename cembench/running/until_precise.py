"""Which cells are measured in more rounds? Those whose intervals are wide, the widest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

from cembench.results.comparison import interval_of_rounds, ratio_interval, ratios_of_rounds
from cembench.results.intervals import Interval
from cembench.results.looks import share_of
from cembench.results.records import Cell, Round, lower_median

#: Seconds of a round beside its calls: to start a process, read the mesh and judge the maps.
BESIDE_CALLS = 0.25

Rounds = Sequence[Round]


def lack(cell: Cell, rounds: Rounds, reference: tuple[Cell, Rounds] | None = None) -> float:
    """Return how many times too wide the intervals of a cell are; precise is what is at most 1.

    Those are the interval of its own seconds and, where it was measured beside a reference, of the
    ratio to that. Infinite where there is no interval yet; 0 for a cell of a fixed number of
    rounds.
    """
    if cell.precision is None:
        return 0.0
    found = [_half(interval_of_rounds(cell, rounds), lower_median([r.seconds for r in rounds]))]
    ratios = ratios_of_rounds(rounds, reference[1]) if reference else []
    if reference and ratios:
        share = share_of(len(ratios), cell, reference[0])
        found.append(_half(ratio_interval(ratios, share), lower_median(ratios)))
    return max(found) / cell.precision


def _half(interval: Interval | None, figure: float) -> float:
    return inf if interval is None else (interval.high - interval.low) / (2 * figure)


def cost(rounds: Rounds) -> float:
    """Return the seconds that another round of a cell will take, judging by the last: a guess."""
    calls = rounds[-1].calls
    return BESIDE_CALLS + sum(calls) + max(calls)  # one call more, to warm up


def affordable(
    lacks: Mapping[str, float],
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
) -> set[str]:
    """Return which cells are measured on in the seconds that are left, with their partners.

    Parameters
    ----------
    lacks : mapping
        How many times too wide a cell's intervals are, by label, see :func:`lack`.
    costs : mapping
        Seconds until the next look, by label, also of partners.
    partners : mapping
        With which cell another one is compared, and so measured side by side.
    seconds : float
        What is left; infinite where there is no limit.

    """
    chosen: set[str] = set()
    for label in sorted(lacks, key=lambda label: (-lacks[label], label)):
        if lacks[label] <= 1:
            continue
        more = {label, partners.get(label, label)} - chosen
        price = sum(costs[one] for one in more)
        if price <= seconds:
            chosen |= more
            seconds -= price
    return chosen
