"""Power laws: how a figure, such as seconds, grows with another, such as the triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

#: Minimum number of different sizes for a meaningful exponent with its error.
FEWEST = 3
#: Sizes whose logarithms have a smaller sum of squares hardly differ, and tell no exponent.
_LEAST_SPREAD = 0.01


@dataclass(frozen=True)
class PowerLaw:
    """y = factor * x ** exponent; `error` is the exponent's standard error over `n` points."""

    factor: float
    exponent: float
    error: float = inf
    n: int = 0

    def at(self, x: float) -> float:
        """Return y for this x."""
        return self.factor * x**self.exponent


def fit(points: Sequence[tuple[float, float]], fewest: int = FEWEST) -> PowerLaw | None:
    """Return the power law fitted to the logarithms of points (x, y) by least squares.

    None for less than `fewest` different x, or where they hardly differ.

    >>> law = fit([(n, 3 * n**1.5) for n in (10.0, 100.0, 700.0)])
    >>> round(law.exponent, 6), round(law.factor, 6)
    (1.5, 3.0)
    """
    if len({x for x, _ in points}) < fewest:
        return None
    x, y = np.log(np.array(points, dtype=float)).T
    off, n = x - x.mean(), len(x)
    spread = float((off**2).sum())
    if spread <= _LEAST_SPREAD:
        return None
    exponent = float((off * y).sum()) / spread
    rest = y - y.mean() - exponent * off
    error = float(np.sqrt((rest**2).sum() / (n - 2) / spread)) if n > 2 else inf
    return PowerLaw(float(np.exp(y.mean() - exponent * x.mean())), exponent, error, n)
