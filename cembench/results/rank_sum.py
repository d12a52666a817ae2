"""By how much do two samples differ, that are no pairs? Exact, from ranks alone.

Wilcoxon's (Mann and Whitney's) rank-sum test, and the interval that belongs to it: between two of
the differences of each value of the one with each of the other.

Source: M. Hollander, D. A. Wolfe, Nonparametric Statistical Methods, 2nd ed., sections 4.1 and 4.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from cembench.results.intervals import ERROR, Interval


@lru_cache(maxsize=64)
def null_distribution(n: int, m: int) -> NDArray[np.float64]:
    """Return P(U <= k) for k = 0, ..., n m: how many pairs have the first sample's value larger."""
    size = n * m + 1
    counts = [1] + [0] * (size - 1)  # whole numbers, as floats would cancel
    for i in range(1, n + 1):
        for k in range(size - 1, m + i - 1, -1):
            counts[k] -= counts[k - m - i]
        for k in range(i, size):
            counts[k] += counts[k - i]
    total = comb(n + m, n)
    return np.cumsum([count / total for count in counts])


def shift_interval(
    ours: Sequence[float], theirs: Sequence[float], error: float = ERROR
) -> Interval | None:
    """Return where the shift of the first sample against the second lies; None for too few."""
    if not ours or not theirs:
        return None
    chances = null_distribution(len(ours), len(theirs))
    left_out = int(np.searchsorted(chances, error / 2, side="right")) - 1
    if left_out < 0:
        return None
    differences = np.sort(_differences(ours, theirs))
    return Interval(float(differences[left_out]), float(differences[-1 - left_out]))


def p_value(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the two-sided probability of samples as far apart as these, were they alike."""
    if not ours or not theirs:
        return 1.0
    differences = _differences(ours, theirs)
    against = min(int((differences >= 0).sum()), int((differences <= 0).sum()))
    return min(1.0, 2 * float(null_distribution(len(ours), len(theirs))[against]))


def _differences(ours: Sequence[float], theirs: Sequence[float]) -> NDArray[np.float64]:
    return np.subtract.outer(np.asarray(ours, float), np.asarray(theirs, float)).ravel()
