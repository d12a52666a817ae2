"""Statistics over surfaces that count families: the objects that surfaces show.

A hundred faces of one statistical model, or three scans of one statue, are no independent samples.
So a family has one figure, the mean over its surfaces, and every interval is over families:

- :func:`share_interval`: of a share, e.g. of the surfaces with a valid map. Wilson's interval with
  the number of families as n. A family's share is between 0 and 1, so its variance is at most
  p (1 - p), that of a family that is mapped as a whole or not at all, for which it is Wilson's: on
  average over p right in 95 %, near p = 1 in 84 % at the least. It says something where all
  succeed, which a bootstrap does not.
- :func:`average_interval`: of an average. Student's interval of the families' figures, whose
  scatter has that of surfaces and rounds in it.
- :func:`rate_interval`: of an average over models, as papers print it, in which every model has the
  same weight: the surfaces of a family miss the average together.
- :func:`votes`: wins. A family has one vote, that of most of its surfaces, and
  :func:`~cembench.results.multiple_testing.sign_test` is exact over votes.

`benchmarks/family_intervals.py` simulates how often they are right, beside intervals that take
surfaces as independent and bootstraps of families.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from math import exp, isclose, isnan, log, sqrt
from statistics import mean, median

import numpy as np

from cembench.results.intervals import DEFAULT_ROUNDS, LEVEL, Interval

#: Minimum number of families for an interval of an average.
FEWEST_FAMILIES = 6


def family_means(figures: Sequence[float], families: Sequence[Hashable]) -> list[float]:
    """Return the mean of each family's figures, families in the order of their first surface.

    >>> family_means([1.0, 0.0, 5.0], ["face", "face", "lion"])
    [0.5, 5.0]
    """
    held: dict[Hashable, list[float]] = {}
    for figure, family in zip(figures, families, strict=True):
        held.setdefault(family, []).append(float(figure))
    return [sum(own) / len(own) for own in held.values()]


def family_geometric(figures: Sequence[float], families: Sequence[Hashable]) -> float:
    """Return the geometric mean over families of the geometric means within them."""
    return exp(mean(family_means(list(map(log, figures)), families)))


def share_interval(share: float, families: int) -> Interval:
    """Return the 95 % Wilson interval of a mean of shares, one for each family.

    >>> round(share_interval(1.0, 10).low, 3)
    0.722
    """
    from scipy.special import ndtri  # slow to import

    z2 = float(ndtri((1 + LEVEL) / 2)) ** 2
    middle = (share + z2 / (2 * families)) / (1 + z2 / families)
    half = sqrt(z2 * (share * (1 - share) / families + z2 / (4 * families**2)))
    half /= 1 + z2 / families
    return Interval(max(0.0, middle - half), min(1.0, middle + half))


def average_interval(
    figures: Sequence[float], families: Sequence[Hashable] | None = None, *, log: bool = True
) -> Interval | None:
    """Return Student's 95 % interval of an average over families; None for fewer than six.

    Parameters
    ----------
    figures : sequence of float
        The positive figures of surfaces, such as ratios of seconds.
    families : sequence of str, optional
        The family of each; default: every surface is one of its own.
    log : bool
        Whether the average is the geometric mean, of which the interval is exact for normal
        logarithms. That of the arithmetic mean is too narrow for skew figures.
    """
    values = np.log(figures) if log else np.asarray(figures, dtype=float)
    if families is not None:
        values = np.array(family_means(values.tolist(), families))
    n = len(values)
    if n < FEWEST_FAMILIES:
        return None
    return _around(float(values.mean()), float(values.std(ddof=1)) / sqrt(n), n, log=log)


def rate_interval(
    figures: Sequence[float], families: Sequence[Hashable], *, log: bool
) -> Interval | None:
    """Return the 95 % interval of the average of ratios t / t_CEM less one, one for each model.

    None for fewer than six families. With `log` the average is the geometric mean. The error of an
    average over n models is the sum of the families' errors over n, and its variance is estimated
    by their squares, with as many degrees of freedom as there are families less one.
    """
    values = np.log(figures) if log else np.asarray(figures, dtype=float)
    held: dict[Hashable, float] = {}
    for value, family in zip(values, families, strict=True):
        held[family] = held.get(family, 0.0) + float(value - values.mean())
    n = len(held)
    if n < FEWEST_FAMILIES:
        return None
    error = sqrt(n / (n - 1) * sum(off**2 for off in held.values())) / len(values)
    around = _around(float(values.mean()), error, n, log=log)
    return Interval(around.low - 1, around.high - 1)


def enough_rounds(rounds: Sequence[int]) -> bool:
    """Whether most figures of an average have the rounds that an interval of their own needs."""
    return bool(rounds) and median(rounds) >= DEFAULT_ROUNDS


def votes(
    first: Sequence[float], second: Sequence[float], families: Sequence[str], same: float = 0.0
) -> tuple[int, int]:
    """Return for how many families most surfaces have the first, and the second figure smaller.

    Figures that are NaN were not measured; those that differ by less than the share `same` are
    equal. A family with as many surfaces either way has no vote.
    """
    known = [
        (a, b, family)
        for a, b, family in zip(first, second, families, strict=True)
        if not (isnan(a) or isnan(b))
    ]
    signs = [0 if isclose(a, b, rel_tol=same) else -1 if a < b else 1 for a, b, _ in known]
    sums = family_means(signs, [family for *_, family in known])
    return sum(s < 0 for s in sums), sum(s > 0 for s in sums)


def _around(middle: float, error: float, families: int, *, log: bool) -> Interval:
    """Return Student's interval of an average of positive figures, or of that of their `log`."""
    from scipy.special import stdtrit  # slow to import

    half = float(stdtrit(families - 1, (1 + LEVEL) / 2)) * error
    low, high = middle - half, middle + half
    return Interval(exp(low), exp(high)) if log else Interval(max(0, low), high)
