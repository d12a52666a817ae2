"""Confidence intervals of a median, and how their error is shared among several looks.

For independent values, k of the n lie below their common median with the probability of k heads in
n tosses. So the j-th smallest and the j-th largest enclose it with a probability that is exact for
any distribution: no normality, no variance, no resampling. Six values are the fewest that reach
95 % (smallest to largest: 1 - 2/2^6 = 96.9 %).

Measuring until an interval is narrow means looking at it several times, and each look can mislead.
So the 5 % error is divided: the interval after the k-th look misses with at most its share of the
5 %, and all of them together with at most 5 %, whatever the reason to stop was (Bonferroni's
inequality; it also holds if one cell's stop depends on other cells). Looks grow by a factor of 1.4:
later ones cost little, and none overshoots by much.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cembench.results.records import Cell


#: Minimum probability that an interval encloses the median.
LEVEL = 0.95
#: Probability that it misses.
ERROR = 0.05
#: The fewest rounds whose smallest and largest figure enclose the median with 95 %: the probability
#: that all are on one side of it is 2 / 2^6.
DEFAULT_ROUNDS = 6


@dataclass(frozen=True)
class Interval:
    """An interval from `low` to `high`, both included."""

    low: float
    high: float

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


def median_interval(values: Sequence[float], level: float = LEVEL) -> Interval | None:
    """Return the narrowest interval that holds the median with probability `level` or more.

    Its ends are values at equal ranks from both ends; None if even the smallest and the largest do
    not reach the level, that is, for fewer than six values at 95 %.
    """
    n = len(values)
    cut, outside = -1, 0.0
    while cut + 1 < n / 2:
        outside += 2 * comb(n, cut + 1) / 2**n
        if outside > 1 - level:
            break
        cut += 1
    if cut < 0:
        return None
    ordered = sorted(values)
    return Interval(ordered[cut], ordered[n - 1 - cut])


#: Numbers of rounds after which the precision is checked.
LOOKS = (7, 10, 14, 20, 28, 40, 56, 80)
#: Share of the 5 % for the first look: the least with which seven rounds can exclude anything,
#: 2 / 2^7. The other looks share the rest.
_FIRST = 2 / 2 ** LOOKS[0] / ERROR
_LATER = (1 - _FIRST) / (len(LOOKS) - 1)

#: Default precision: largest half-width of an interval, relative to its figure.
USUAL_PRECISION = 0.05
#: Default maximum number of rounds of a cell.
USUAL_MAX_ROUNDS = 56


def share(rounds: int) -> float:
    """Return the part of the 5 % for an interval of this many rounds, that of the next look."""
    return _FIRST if rounds <= LOOKS[0] else _LATER


def share_of(rounds: int, *cells: Cell) -> float:
    """As :func:`share`, but the whole 5 % if the number of rounds was fixed in advance."""
    return share(rounds) if any(cell.precision is not None for cell in cells) else 1.0


def next_look(rounds: int, most: int) -> int:
    """Return the number of rounds at the next look, at most `most`."""
    place = bisect_left(LOOKS, rounds + 1)
    return min(LOOKS[place], most) if place < len(LOOKS) else most


def is_look(rounds: int, most: int) -> bool:
    """Whether the precision is checked after this many rounds."""
    return rounds in LOOKS or rounds == most
