"""Performance profiles as staircases (Dolan and More, 2002).

For each algorithm the share of the surfaces on which its cost is at most tau times the best one
there; an infinite ratio, where it has no good map, keeps a curve below 100 %.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

from cembench.report.content.evidence import Evidence
from cembench.report.plots import Axis, PlotPanel, PlotSeries


def profile_panel(
    evidence: Evidence,
    ratios: Mapping[str, Sequence[float]],
    n: int,
    *,
    best: str,
    title: str,
    farthest: float = inf,
) -> PlotPanel:
    """Return a panel with a staircase for each series that has ratios.

    Parameters
    ----------
    evidence : Evidence
        The run; its order of series is kept.
    ratios : mapping of str to sequence of float
        By label of the series, cost over the best cost, one for each of `n` surfaces.
    n : int
        Number of surfaces.
    best : str
        What the best is called on the axis: "the fastest".
    title : str
        The panel's title.
    farthest : float
        Larger ratios are not distinguished.

    """
    finite = [r for found in ratios.values() for r in found if r < inf]
    last = min(farthest, 1.15 * max(finite))
    lines = []
    for series in (s for s in evidence.series if s.label in ratios):
        ordered = sorted(r for r in ratios[series.label] if r <= last)
        x = [1.0, *ordered, last]
        y = [100 * sum(r <= tau for r in ordered) / n for tau in x]
        lines.append(PlotSeries(series.label, x, y, "steps", evidence.styles[series.label]))
    return PlotPanel(
        Axis(f"tau, times {best}", log=True, low=1.0, high=last),
        Axis("surfaces (%)", low=0, high=104),
        tuple(lines),
        f"{title}, n = {n}",
    )
