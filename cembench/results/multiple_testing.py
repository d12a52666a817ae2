"""Statistics over many comparisons and over surfaces.

Each function answers a different question:

- :func:`corrected`: verdicts of which *any* is wrong with probability at most 5 % (Holm).
- :func:`sign_test`: whether one algorithm wins on more surfaces than chance allows.
- :func:`average_interval`: how much an average would vary on other surfaces of this kind and in
  other rounds; :func:`rate_interval` is that of an average speedup, if it has enough rounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import comb
from statistics import median

import numpy as np
from numpy.typing import NDArray

from cembench.results.comparison import Comparison
from cembench.results.intervals import DEFAULT_ROUNDS, ERROR, LEVEL, Interval

#: Number of bootstrap draws of an average.
DRAWS = 2000
#: Minimum number of surfaces for an interval of an average.
FEWEST_SURFACES = 6


def holm(chances: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number by Holm's method.

    With m values in order, the k-th smallest (from 0) is multiplied by m - k, and none is smaller
    than the one before (S. Holm, 1979). It is valid for any dependence between the p-values.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03])
    [0.03, 0.06, 0.06]

    """
    found = [0.0] * len(chances)
    so_far = 0.0
    for k, place in enumerate(sorted(range(len(chances)), key=lambda i: chances[i])):
        so_far = max(so_far, min(1.0, (len(chances) - k) * chances[place]))
        found[place] = so_far
    return found


def corrected(found: Sequence[Comparison]) -> list[Comparison]:
    """Return comparisons with verdicts that are all correct with probability 95 %.

    A verdict is kept if its own exact interval shows it, and if its p-value is also significant
    among so many (:mod:`cembench.results.rank_tests`). The intervals stay single ones: each
    holds its ratio with 95 %, not all of them at once.
    """
    tested = [one.p for one in found if one.interval is not None]
    if len(tested) < 2:
        return list(found)
    chances = iter(holm(tested))
    told = []
    for one in found:
        p = next(chances) if one.interval is not None else 1.0
        lost = p > ERROR and one.verdict in ("faster", "slower")
        told.append(replace(one, p=p, verdict="undecided") if lost else replace(one, p=p))
    return told


def sign_test(wins: int, losses: int) -> float:
    """Return the two-sided p-value of the exact sign test.

    Ties are not counted; 1 without wins and losses.
    """
    n, fewer = wins + losses, min(wins, losses)
    return min(1.0, 2 * sum(comb(n, k) for k in range(fewer + 1)) / 2**n)


def average_interval(
    surfaces: Sequence[Sequence[float]],
    average: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    seed: int = 0,
    level: float = LEVEL,
) -> Interval | None:
    """Return a bootstrap interval of an average over surfaces and rounds.

    The bootstrap is hierarchical: surfaces are drawn with replacement, and rounds within each; the
    figure of a surface is the median of its rounds. It is approximate, and too narrow for few
    surfaces: None below :data:`FEWEST_SURFACES`.

    Parameters
    ----------
    surfaces : sequence of sequences
        The ratios of the rounds, one sequence per surface.
    average : function of an array (draws, surfaces)
        The average along the last axis, (draws,).
    seed : int
        Seed of the draws; the same seed gives the same interval.
    level : float
        Probability that the interval covers the average.

    """
    if len(surfaces) < FEWEST_SURFACES:
        return None
    rng = np.random.default_rng(seed)
    logs = [np.log(np.asarray(ratios, dtype=float)) for ratios in surfaces]
    chosen = rng.integers(0, len(logs), DRAWS * len(logs))
    figures = np.empty(chosen.shape)
    in_order = np.argsort(chosen.astype(np.min_scalar_type(len(logs))), kind="stable")
    places = np.split(in_order, np.cumsum(np.bincount(chosen, minlength=len(logs)))[:-1])
    for draws, values in zip(places, logs, strict=True):
        drawn = rng.integers(0, len(values), (len(draws), len(values)))
        figures[draws] = np.median(values[drawn], axis=1)
    averages = average(np.exp(figures).reshape(DRAWS, len(logs)))
    low, high = np.quantile(averages, [(1 - level) / 2, (1 + level) / 2])
    return Interval(float(low), float(high))


def arithmetic(ratios: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the arithmetic means along the last axis, as the paper averages."""
    return np.asarray(ratios.mean(axis=-1))


def geometric(ratios: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the geometric means along the last axis."""
    return np.asarray(np.exp(np.log(ratios).mean(axis=-1)))


def rate_interval(
    surfaces: Sequence[Sequence[float]],
    average: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> Interval | None:
    """Return the interval of an average rate of speedup, the average of t / t_CEM, minus one.

    The arguments are those of :func:`average_interval`; None also if most surfaces have fewer
    rounds than an interval of their own needs.
    """
    if not surfaces or median(map(len, surfaces)) < DEFAULT_ROUNDS:
        return None
    found = average_interval(surfaces, average)
    return found and Interval(found.low - 1, found.high - 1)
