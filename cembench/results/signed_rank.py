"""How sure is the centre of values that scatter evenly to both sides? Exact, from ranks alone.

Wilcoxon's signed-rank test, and the interval that belongs to it: between two of the Walsh averages
(the means of all pairs of values). Where the values scatter evenly about their centre, the chance
that it lies outside is known whatever the distribution is. Logarithms of ratios of two equal
algorithms do so by construction, as the order within a round is random. For n normal values the
interval is about as narrow as Student's, half as wide as from the smallest to the largest of 20.

Source: M. Hollander, D. A. Wolfe, Nonparametric Statistical Methods, 2nd ed., sections 3.1 and 3.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cembench.results.intervals import ERROR, Interval


@lru_cache(maxsize=256)
def null_distribution(n: int) -> NDArray[np.float64]:
    """Return P(T <= k) for k = 0, ..., n (n+1)/2, T being the sum of ranks with a positive sign."""
    chances = np.zeros(n * (n + 1) // 2 + 1)
    chances[0] = 1.0
    for rank in range(1, n + 1):
        moved = np.zeros_like(chances)
        moved[rank:] = chances[:-rank]
        chances = (chances + moved) / 2
    return np.cumsum(chances)


def cut(n: int, error: float = ERROR) -> int:
    """Return how many Walsh averages are left out on either side; -1 where there is no interval."""
    # Sums of halves are exact here, so equality with a level counts as reached.
    return int(np.searchsorted(null_distribution(n), error / 2, side="right")) - 1


def walsh_averages(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the means of all pairs of values (..., n), each with itself too, in order."""
    i, j = np.triu_indices(values.shape[-1])
    averages: NDArray[np.float64] = np.sort((values[..., i] + values[..., j]) / 2, axis=-1)
    return averages


def centre_interval(values: Sequence[float], error: float = ERROR) -> Interval | None:
    """Return where the centre lies, missed with a probability of at most `error`.

    None where even the smallest and the largest value miss it more often: 2 / 2^n > error.

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


def p_value(values: Sequence[float]) -> float:
    """Return the two-sided probability of values as uneven about 0 as these, were 0 the centre.

    It is at most `error` exactly where :func:`centre_interval` does not hold 0; ties with 0 count
    against a difference. 1 for no values.
    """
    averages = walsh_averages(np.asarray(values, dtype=float))
    against = min(int((averages >= 0).sum()), int((averages <= 0).sum()))
    return min(1.0, 2 * float(null_distribution(len(values))[against]))
