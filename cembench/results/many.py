"""Statements that are made together: how sure are they all, and what do they say of surfaces?

Each answers a question of its own:

- :func:`corrected`: is *any* of these verdicts wrong? With at most 5 % (Holm).
- :func:`sign_test`: does one win on more surfaces than chance would let it? Over surfaces.
- :func:`average_interval`: how far would an average be from this on other surfaces of this kind,
  and in other rounds? Over both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import comb

import numpy as np
from numpy.typing import NDArray

from cembench.results.comparison import Comparison
from cembench.results.intervals import ERROR, LEVEL, Interval

#: How often an average is drawn anew.
DRAWS = 2000
#: The fewest surfaces that an average gets an interval for: of fewer, nothing can be drawn.
FEWEST_SURFACES = 6


def holm(chances: Sequence[float]) -> list[float]:
    """Return each p-value corrected for all of them: at most 5 % for those that can be claimed.

    With the m of them in order, the k-th smallest (from 0) is multiplied by m - k, and none is
    smaller than the one before (S. Holm, 1979). Holds however the p-values depend on each other.

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
    """Return comparisons that stand together with verdicts of which none is wrong, with 95 %.

    A verdict stays where its own interval shows it, exactly, and where it also is clear enough for
    one of so many (:mod:`cembench.results.student`). The intervals stay single ones: each holds its
    ratio with 95 %, not all of them at once.
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
    """Return the probability that k of n, or fewer or more, are as uneven as this by chance.

    Two-sided, exact; ties are not counted. 1 for none.
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
    """Return where an average over surfaces lies, as surfaces and rounds vary.

    A hierarchical bootstrap: surfaces are drawn with replacement, and rounds within each; the
    figure of a surface is the median of its rounds. Approximate, and too narrow for few surfaces:
    None below :data:`FEWEST_SURFACES`.

    Parameters
    ----------
    surfaces : sequence of sequences
        The ratio of each round, by surface.
    average : function of an array (draws, surfaces)
        The average along the last axis, (draws,).
    seed : int
        Of what is drawn; the same seed gives the same interval.
    level : float
        With which probability.

    """
    if len(surfaces) < FEWEST_SURFACES:
        return None
    rng = np.random.default_rng(seed)
    logs = [np.log(np.asarray(ratios, dtype=float)) for ratios in surfaces]
    figures = np.empty((DRAWS, len(logs)))
    chosen = rng.integers(0, len(logs), figures.shape)
    for place, values in enumerate(logs):
        here = chosen == place
        drawn = rng.integers(0, len(values), (int(here.sum()), len(values)))
        figures[here] = np.median(values[drawn], axis=1)
    low, high = np.quantile(average(np.exp(figures)), [(1 - level) / 2, (1 + level) / 2])
    return Interval(float(low), float(high))
