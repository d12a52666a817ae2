"""Statistics over many comparisons.

Each function answers a different question:

- :func:`corrected`: verdicts of which *any* is wrong with probability at most 5 % (Holm).
- :func:`sign_test`: whether one algorithm wins more often than chance allows.

What would be on other surfaces is a question to :mod:`cembench.results.families`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from cembench.results.comparison import Comparison
from cembench.results.intervals import ERROR

C = TypeVar("C", Comparison, Comparison | None)


def holm(chances: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number by Holm's method.

    With m values in order, the k-th smallest (from 0) is multiplied by m - k, and none is smaller
    than the one before (S. Holm, 1979). It is valid for any dependence between the p-values.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03])
    [0.03, 0.06, 0.06]
    """
    adjusted = [0.0] * len(chances)
    so_far = 0.0
    for k, place in enumerate(sorted(range(len(chances)), key=lambda i: chances[i])):
        so_far = max(so_far, min(1.0, (len(chances) - k) * chances[place]))
        adjusted[place] = so_far
    return adjusted


def corrected(found: Sequence[C]) -> list[C]:
    """Return comparisons with verdicts that are all correct with probability 95 %.

    A verdict is kept if its own exact interval shows it, and if its p-value is also significant
    among so many (:mod:`cembench.results.rank_tests`). The intervals stay single ones: each
    holds its ratio with 95 %, not all of them at once. None stays where there was no comparison.
    """
    tested = [one.p for one in found if one is not None and one.interval is not None]
    if len(tested) < 2:
        return list(found)
    chances = iter(holm(tested))
    verdicts: list[C] = []
    for one in found:
        if one is None:
            verdicts.append(one)
            continue
        p = next(chances) if one.interval is not None else 1.0
        lost = p > ERROR and one.verdict in ("faster", "slower")
        verdicts.append(replace(one, p=p, verdict="undecided") if lost else replace(one, p=p))
    return verdicts


def sign_test(wins: int, losses: int) -> float:
    """Return the two-sided p-value of the exact sign test.

    Ties are not counted; 1 without wins and losses.
    """
    n, fewer = wins + losses, min(wins, losses)
    return min(1.0, 2 * sum(comb(n, k) for k in range(fewer + 1)) / 2**n)


def geometric(ratios: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the geometric means along the last axis."""
    return np.asarray(np.exp(np.log(ratios).mean(axis=-1)))
