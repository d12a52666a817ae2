"""Confidence interval of a median, from the order of the values alone.

For independent values, k of the n lie below their common median with the probability of k heads in
n tosses. So the j-th smallest and the j-th largest enclose it with a probability that is exact for
any distribution: no normality, no variance, no resampling. Six values are the fewest that reach
95 % (smallest to largest: 1 - 2/2^6 = 96.9 %).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

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
