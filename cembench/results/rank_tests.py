"""Exact tests and intervals from ranks, and p-values beyond their resolution.

Signed ranks: Wilcoxon's test of the centre of symmetric values, and its interval, whose ends are
two of the Walsh averages (the means of all pairs of values). If the values are symmetric about
their centre, the probability that the interval misses it is known for any distribution. Logarithms
of time ratios of two equally fast algorithms are symmetric by construction, as the order within a
round is random. For normal values the interval is about as narrow as Student's, and for 20 values
half as wide as their range.

Rank sums: the Wilcoxon (Mann-Whitney) test of two unpaired samples, and its interval, whose ends
are two of the differences between values of the two.

Student's t: with n rounds, signs and ranks alone give no p-value below 2 / 2^n, however large the
difference is: too large for one of a hundred statements. Student's t has no such limit, for noise
that is roughly normal on logarithms. One degree of freedom is taken off, which covers noise with
flatter tails, such as from a steady drift; for heavier tails the test is conservative anyway.
`benchmarks/precision.py` simulates the resulting error rates.

Source: M. Hollander, D. A. Wolfe, Nonparametric Statistical Methods, 2nd ed., sections 3.1, 3.3,
4.1 and 4.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import comb, inf, sqrt
from statistics import mean, variance

import numpy as np
from numpy.typing import NDArray

from cembench.results.intervals import ERROR, Interval


@lru_cache(maxsize=256)
def null_distribution(n: int) -> NDArray[np.float64]:
    """Return P(T <= k), k = 0, ..., n (n+1)/2; T is the sum of ranks with a positive sign."""
    chances = np.zeros(n * (n + 1) // 2 + 1)
    chances[0] = 1.0
    for rank in range(1, n + 1):
        moved = np.zeros_like(chances)
        moved[rank:] = chances[:-rank]
        chances = (chances + moved) / 2
    return np.cumsum(chances)


def cut(n: int, error: float = ERROR) -> int:
    """Return the number of Walsh averages left out on either side; -1 if there is no interval."""
    # Sums of powers of 1/2 are exact, so a probability equal to the level counts as reached.
    return int(np.searchsorted(null_distribution(n), error / 2, side="right")) - 1


def walsh_averages(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sorted means of all pairs of values (..., n), including each with itself."""
    i, j = np.triu_indices(values.shape[-1])
    averages: NDArray[np.float64] = np.sort((values[..., i] + values[..., j]) / 2, axis=-1)
    return averages


def centre_interval(values: Sequence[float], error: float = ERROR) -> Interval | None:
    """Return the interval of the centre, which misses with a probability of at most `error`.

    None for too few values: if even the smallest and the largest miss more often, 2 / 2^n > error.

    Examples
    --------
    >>> centre_interval([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    Interval(low=1.0, high=6.0)
    """
    left_out = cut(len(values), error)
    if left_out < 0:
        return None
    averages = walsh_averages(np.asarray(values, dtype=float))
    return Interval(float(averages[left_out]), float(averages[-1 - left_out]))


@lru_cache(maxsize=64)
def rank_sum_distribution(n: int, m: int) -> NDArray[np.float64]:
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
    chances = rank_sum_distribution(len(ours), len(theirs))
    left_out = int(np.searchsorted(chances, error / 2, side="right")) - 1
    if left_out < 0:
        return None
    differences = np.sort(np.subtract.outer(np.array(ours, float), np.array(theirs, float)).ravel())
    return Interval(float(differences[left_out]), float(differences[-1 - left_out]))


def paired_p(logs: Sequence[float]) -> float:
    """Return the two-sided p-value of Student's t for mean 0; 1 for fewer than three values."""
    if len(logs) < 3:
        return 1.0
    return _two_sided(mean(logs), sqrt(variance(logs) / len(logs)), len(logs) - 2)


def unpaired_p(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the two-sided p-value of two samples with unequal variances."""
    fewest = min(len(ours), len(theirs))
    if fewest < 3:
        return 1.0
    error = sqrt(variance(ours) / len(ours) + variance(theirs) / len(theirs))
    return _two_sided(mean(ours) - mean(theirs), error, fewest - 2)


def _two_sided(difference: float, error: float, freedom: int) -> float:
    from scipy.special import stdtr

    if difference == 0:
        return 1.0
    t = abs(difference) / error if error > 0 else inf
    return float(2 * stdtr(freedom, -t))
