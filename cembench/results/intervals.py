"""How sure is a median? An interval from the order of the values alone.

For independent values, k of the n lie below their common median with the probability of k heads in
n tosses. So the j-th smallest and the j-th largest enclose it with a probability that holds exactly
whatever the distribution: no normality, no variance, no resampling. Six values are the fewest for
which that reaches 95 % (smallest to largest: 1 - 2/2^6 = 96.9 %).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

#: The probability with which an interval encloses the median, at least.
LEVEL = 0.95
#: With which it may miss.
ERROR = 0.05


@dataclass(frozen=True)
class Interval:
    """From `low` to `high`, both included."""

    low: float
    high: float

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


def median_interval(values: Sequence[float], level: float = LEVEL) -> Interval | None:
    """Between which two of the values does the median lie, with probability `level` or more?

    The narrowest such pair, as far from the smallest as from the largest; None where even the
    smallest and the largest do not reach the level, that is, with fewer than six values at 95 %.
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
