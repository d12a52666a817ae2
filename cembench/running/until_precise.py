"""Choose the cells that need more rounds, within the time that is left.

Before the first look, when no cell has an interval, the cheapest come first: most cells get one.
After it those with the widest intervals do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

from cembench.results.comparison import interval_of_rounds, ratio_interval, ratios_of_rounds
from cembench.results.intervals import Interval
from cembench.results.looks import share_of
from cembench.results.records import Cell, Round, lower_median
from cembench.running.measure import ENOUGH_SECONDS

#: Overhead of a round in seconds: starting a process, reading the mesh and judging the maps.
BESIDE_CALLS = 0.25

Rounds = Sequence[Round]


def lack(cell: Cell, rounds: Rounds, reference: tuple[Cell, Rounds] | None = None) -> float:
    """Return the factor by which a cell's intervals are too wide; at most 1 is precise.

    The intervals are that of its seconds and, if it was measured with a reference, that of the
    ratio. Where compared cells shared processes, only the ratio counts. Infinite if there is no
    interval yet; 0 for a cell with a fixed number of rounds.
    """
    if cell.precision is None:
        return 0.0
    shared = bool(rounds) and all(r.together for r in rounds)
    own = _half(interval_of_rounds(cell, rounds), lower_median([r.seconds for r in rounds]))
    found = [0.0 if shared else own]
    share = share_of(len(rounds), cell, reference[0]) if reference else 1.0
    ratios = ratios_of_rounds(rounds, reference[1], share) if reference else []
    if reference and ratios:
        found.append(_half(ratio_interval(ratios, share), lower_median(ratios)))
    return max(found) / cell.precision


def _half(interval: Interval | None, figure: float) -> float:
    return inf if interval is None else (interval.high - interval.low) / (2 * figure)


def each_round(seconds: float) -> float:
    """Return the estimated seconds of a cell's calls in a process, from those of one call."""
    return seconds + max(seconds, ENOUGH_SECONDS)


def cost(rounds: Rounds) -> float:
    """Return the estimated seconds of another round of a cell, based on the last one."""
    calls, shared = rounds[-1].calls, rounds[-1].together
    more = sum(shared) + max(shared) if shared else 0.0
    return BESIDE_CALLS + sum(calls) + max(calls) + more  # one call more each, to warm up


def affordable(
    lacks: Mapping[str, float],
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
) -> set[str]:
    """Return the cells that get more rounds in the remaining seconds, with their partners.

    Parameters
    ----------
    lacks : mapping
        Factor by which a cell's intervals are too wide, by label; see :func:`lack`.
    costs : mapping
        Seconds until the next look, by label, including those of partners.
    partners : mapping
        The cell with which a cell is compared, and so measured side by side.
    seconds : float
        Remaining seconds; infinite without a limit.

    """
    lacking = [label for label in lacks if lacks[label] > 1]
    widest = sorted(lacking, key=lambda label: (-lacks[label], label))
    return _within(widest, costs, partners, seconds)


def cheapest(
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
    surfaces: Mapping[str, str] | None = None,
) -> set[str]:
    """Return the cells that reach their first look in the remaining seconds, the cheapest first.

    Parameters are those of :func:`affordable`; a cell's partner is measured with it. With
    `surfaces`, the surface of each cell, the cheapest surfaces come first, each with all its cells.
    """
    chosen: set[str] = set()
    groups: dict[str, list[str]] = {}
    for label, surface in (surfaces or {}).items():
        groups.setdefault(surface, []).append(label)
    for price, group in sorted(
        (sum(costs[one] for one in group), group) for group in groups.values()
    ):
        if price > seconds:
            break
        chosen.update(group)
        seconds -= price

    def price_beside(label: str) -> float:
        return sum(costs[one] for one in {label, partners.get(label, label)})

    ordered = sorted(costs.keys() - chosen, key=lambda label: (price_beside(label), label))
    return chosen | _within(ordered, costs, partners, seconds)


def _within(
    ordered: Sequence[str],
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
) -> set[str]:
    """Return the cells that can be paid for, in this order, each with its partner."""
    chosen: set[str] = set()
    for label in ordered:
        more = {label, partners.get(label, label)} - chosen
        price = sum(costs[one] for one in more)
        if price <= seconds:
            chosen |= more
            seconds -= price
    return chosen
