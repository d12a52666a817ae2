"""Whether compared algorithms share a process in each round, by how this machine scatters.

Processes differ: each has its own addresses and pages, from its first call to its last. On some
machines that scatters the ratio of two algorithms more than all else. In one process both have the
same. But there one can disturb the other, by accident (pools, caches) or on purpose. So each round
still has a process for every cell, and the ratios of these are the control of the shared one's: see
:func:`cembench.results.comparison.compare`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import sqrt
from statistics import NormalDist
from typing import Literal

import numpy as np

from cembench.results.intervals import ERROR, LOOKS, share

Pairing = Literal["auto", "separate", "process"]

#: Number of processes that show the scatter, and the largest share of a run that they may take.
PROCESSES, WORTH = 10, 0.05
#: Cost of a round with both kinds of processes, relative to one with separate processes.
COST = 2.0
#: Efficiency of the signed-rank interval for values that scatter normally.
_EFFICIENCY = 3 / np.pi


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of the logarithm of the ratio of two equal calls."""

    #: Between processes, and within one.
    separate: float
    together: float

    @classmethod
    def of(cls, seconds: Sequence[tuple[float, float]]) -> Scatter:
        """Return the scatter from the seconds of twins, a pair for each process."""
        a, b = np.log(np.array(seconds)).T
        return cls(sqrt(a.var(ddof=1) + b.var(ddof=1)), float((a - b).std(ddof=1)))

    @property
    def pairing_is_narrower(self) -> bool:
        """Whether sharing processes gives narrower intervals of ratios in the same time."""
        return COST * self.together**2 < self.separate**2

    def half_width(self, rounds: int, *, pairs: bool) -> float:
        """Return the expected half-width of the interval of a ratio, relative to the ratio."""
        scatter = self.together if pairs else self.separate
        quantile = NormalDist().inv_cdf(1 - ERROR * share(rounds) / 2)
        return quantile * scatter / sqrt(_EFFICIENCY * rounds)

    def forecast(self, prices: Sequence[float], seconds: float, *, pairs: bool) -> str:
        """Return a sentence on what can be expected.

        `prices` are the seconds of a round of each cell, `seconds` those that the run has left.
        """
        scatter = (
            f"this machine: ratios of equal calls scatter by {self.separate:.1%} between processes "
            f"and by {self.together:.1%} within one, so algorithms are compared "
            f"{'within one process of each round' if pairs else 'between processes'}; "
        )
        first = LOOKS[0]
        costs = accumulate(sorted((COST if pairs else 1.0) * first * price for price in prices))
        bought = sum(cost <= seconds for cost in costs)
        if not bought:
            return f"{scatter}the time is not enough for the {first} rounds that an interval takes"
        width = self.half_width(first, pairs=pairs)
        those = "each cell" if bought == len(prices) else f"about {bought} of {len(prices)} cells"
        return f"{scatter}{first} rounds of {those} make ratios certain to ±{width:.1%} at best"
