"""Averages of speedup rates, in two readings of the paper's means.

A rate is t / t_CEM - 1. The paper averages rates arithmetically, where one
large ratio counts as much as many small ones, and converts that mean to a saving. The geometric
mean of the ratios and the mean of the savings weight every model equally.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cembench.report.content.printed_beside_measured import Footer
from cembench.results.papers import Paper


def mean_rate(rates: Sequence[float]) -> float:
    """Return the arithmetic mean of the rates, as in the paper."""
    return float(np.mean(rates))


def geometric_rate(rates: Sequence[float]) -> float:
    """Return the geometric mean of the ratios 1 + rate, minus one."""
    return float(np.exp(np.mean(np.log1p(rates))) - 1)


def saving_of_mean(rates: Sequence[float]) -> float:
    """Return the share of time that the mean rate saves, 1 - 1/(1 + mean), as in the paper."""
    return 1 - 1 / (1 + mean_rate(rates))


def mean_saving(rates: Sequence[float]) -> float:
    """Return the mean over the models of the share of time saved, 1 - 1/(1 + rate)."""
    return float(np.mean([1 - 1 / (1 + rate) for rate in rates]))


def _rate(number: float) -> str:
    return f"{number:.1f}"


def percent(number: float) -> str:
    """Return a share as a whole percentage."""
    return f"{100 * number:.0f} %"


#: Label, function and format of each reading, the paper's own first.
READINGS = (
    Footer("mean rate (as the paper)", mean_rate, _rate),
    Footer("geometric mean of ratios - 1", geometric_rate, _rate),
    Footer("saving, 1 - 1/(1 + mean)", saving_of_mean, percent),
    Footer("mean of the savings", mean_saving, percent),
)


def printed_rates(paper: Paper, algorithm: str, models: Sequence[str] | None = None) -> list[float]:
    """Return the printed rates for these models (default: all), misprints from the seconds."""
    chosen = paper.models if models is None else models
    rates = (corrected_rate(paper, model, algorithm) for model in chosen)
    return [rate for rate in rates if rate is not None]


def corrected_rate(paper: Paper, model: str, algorithm: str) -> float | None:
    """Return a printed rate, or for a misprint the one that follows from the printed seconds."""
    rates, seconds = paper.table_of("rate"), paper.table_of("seconds")
    if rates is not None and (rates, model, algorithm) not in paper.misprints:
        return paper.tables[rates][model][algorithm]
    times = paper.tables[seconds][model] if seconds is not None else {}
    ours, theirs = times.get(paper.reference), times.get(algorithm)
    return None if ours is None or theirs is None else theirs / ours - 1
