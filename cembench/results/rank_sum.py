"""Difference of two unpaired samples: exact test and interval from ranks.

The Wilcoxon (Mann-Whitney) rank-sum test, and its interval, whose ends are two of the differences
between values of the two samples.

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
    """Return P(U <= k), k = 0, ..., n m; U counts pairs with the first sample's value larger."""
    size = n * m + 1
    counts = [1] + [0] * (size - 1)  # integers, because floats would suffer cancellation
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
    """Return the interval of the shift between two samples; None for too few values."""
    if not ours or not theirs:
        return None
    chances = null_distribution(len(ours), len(theirs))
    left_out = int(np.searchsorted(chances, error / 2, side="right")) - 1
    if left_out < 0:
        return None
    differences = np.sort(_differences(ours, theirs))
    return Interval(float(differences[left_out]), float(differences[-1 - left_out]))


def p_value(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the two-sided p-value of the rank-sum test."""
    if not ours or not theirs:
        return 1.0
    differences = _differences(ours, theirs)
    against = min(int((differences >= 0).sum()), int((differences <= 0).sum()))
    return min(1.0, 2 * float(null_distribution(len(ours), len(theirs))[against]))


def _differences(ours: Sequence[float], theirs: Sequence[float]) -> NDArray[np.float64]:
    return np.subtract.outer(np.asarray(ours, float), np.asarray(theirs, float)).ravel()
