"""What a declared plot draws besides its points: power laws, a front, and performance profiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from cembench.report.palette import PLAIN, SeriesStyle
from cembench.report.plots import PlotSeries, Point, through

if TYPE_CHECKING:
    import pandas as pd

#: Minimum number of points for a meaningful exponent.
FEWEST = 3


@dataclass(frozen=True)
class Fit:
    """y = factor * x ** exponent, fitted to logarithms; `error` is the standard error."""

    exponent: float
    factor: float
    error: float
    n: int


def fit(points: Sequence[Point]) -> Fit | None:
    """Return the power law fitted to points; None for too few of them or too few different x."""
    if len(points) < FEWEST or len({p.x for p in points}) < FEWEST:
        return None
    x, y = (np.log([p[k] for p in points]) for k in (0, 1))
    spread = float(((x - x.mean()) ** 2).sum())
    exponent = float(((x - x.mean()) * (y - y.mean())).sum()) / spread
    rest = y - y.mean() - exponent * (x - x.mean())
    error = float(np.sqrt((rest**2).sum() / (len(x) - 2) / spread))
    return Fit(exponent, float(np.exp(y.mean() - exponent * x.mean())), error, len(x))


def power_law(label: str, points: Sequence[Point], style: SeriesStyle) -> PlotSeries | None:
    """Return the line of a power law through points; None if there is none to fit."""
    law = fit(points)
    if law is None:
        return None
    ends = [min(p.x for p in points), max(p.x for p in points)]
    line = [law.factor * e**law.exponent for e in ends]
    tooltips = [f"{label}: exponent {law.exponent:.2f}"] * 2
    return PlotSeries(f"{label}, fitted", ends, line, "line", style, tooltips, named=False)


def front(clouds: Mapping[str, Sequence[Point]]) -> PlotSeries:
    """Return the geometric means of clouds of points that none of the others beats in x and y."""

    def middle(values: Sequence[float]) -> float:
        return float(np.exp(np.mean(np.log(values))))

    means = [
        Point(middle([p.x for p in cloud]), middle([p.y for p in cloud]), label)
        for label, cloud in clouds.items()
    ]

    def beats(one: Point, other: Point) -> bool:
        return one.x <= other.x and one.y <= other.y and one[:2] != other[:2]

    best = sorted(m for m in means if not any(beats(other, m) for other in means))
    return through("not beaten on average", best, "both", PLAIN)


def cost_ratios(frame: pd.DataFrame, cost: pd.Series, least: float = 0.0) -> pd.DataFrame:
    """Return costs over the smallest ones: a row for each surface, a column for each algorithm.

    Only surfaces that all of these algorithms were tried on, and one mapped, are in it. Variants
    are left out if they were tried on fewer surfaces than the algorithms' main choices.

    Parameters
    ----------
    frame : DataFrame
        Records, with `place` (of the surface), `label` and `main`.
    cost : Series
        Their costs, infinite where there is no good map.
    least : float
        Smaller costs count as this.

    """
    table = frame.assign(cost=cost).pivot(index="place", columns="label", values="cost")
    labels = frame.sort_values("series", kind="stable")[["label", "main"]].drop_duplicates("label")
    tried = table.notna().sum()
    fewest = tried[labels["label"][labels["main"]]].min() if labels["main"].any() else 0
    shown = [
        label for label, main in labels.itertuples(index=False) if main or tried[label] >= fewest
    ]
    table = table[shown].dropna().clip(lower=least)
    table = table[table.min(axis=1) < inf]
    return table.div(table.min(axis=1), axis=0)


def staircase(
    ratios: Sequence[float], last: float, weights: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return the performance profile of ratios: x up to `last`, and the share in percent.

    It is the weighted share of surfaces on which a cost is at most tau times the best one there
    (Dolan and More, 2002). Infinite ratios, where there is no good map, keep a curve below 100 %.

    >>> staircase([1.0, 2.0, inf, inf], 4.0, [1, 1, 1, 1])
    ([1.0, 1.0, 2.0, 4.0], [25.0, 25.0, 50.0, 50.0])
    """
    ordered = sorted(pair for pair in zip(ratios, weights, strict=True) if pair[0] <= last)
    x = [1.0, *(ratio for ratio, _ in ordered), last]
    return x, [100 * sum(w for r, w in ordered if r <= tau) / sum(weights) for tau in x]
