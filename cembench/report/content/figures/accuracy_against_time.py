"""Plot of accuracy against time, with the Pareto front of the algorithms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cembench.report.content.evidence import Evidence
from cembench.report.plots import Axis, Plot, PlotPanel, Point, through
from cembench.results.records import Record

METRIC = "angle_error_mean_deg"


def accuracy_against_time(evidence: Evidence) -> Plot | None:
    """Return a plot with a point per cell, relative to the best on its surface, and the means."""
    panels = tuple(p for policy in evidence.policies if (p := _panel(evidence, policy)))
    if not panels:
        return None
    return Plot(
        "accuracy-against-time",
        "Accuracy against time, relative to the best on each surface",
        panels,
        "Horizontal: time relative to the fastest algorithm on the same surface. Vertical: mean "
        "angle error relative to the smallest there. At (1, 1) an algorithm is best in "
        "both. Joined points are the geometric means of the algorithms that no other algorithm "
        "beats in both. Maps to the disk only.",
        "A cloud of points for each algorithm; closer to the lower left corner is better.",
    )


def _panel(evidence: Evidence, policy: str) -> PlotPanel | None:
    clouds: dict[str, list[Point]] = {s.label: [] for s in evidence.disk_series}
    for surface in evidence.surfaces:
        found = [(s, evidence.find(surface, s, policy)) for s in evidence.disk_series]
        known = {s.label: figures for s, r in found if r and (figures := _figures(r))}
        if len(known) < 2:
            continue
        fastest, finest = (min(figures[k] for figures in known.values()) for k in (0, 1))
        for label, (seconds, error) in known.items():
            clouds[label].append(Point(seconds / fastest, error / finest, surface.title))
    if not any(clouds.values()):
        return None
    drawn = [
        through(s.label, clouds[s.label], "points", evidence.styles[s.label])
        for s in evidence.disk_series
        if clouds[s.label]
    ]
    middles = [_middle(label, cloud) for label, cloud in clouds.items() if cloud]
    front = sorted(m for m in middles if not any(_beats(other, m) for other in middles))
    return PlotPanel(
        Axis("time, times the fastest", log=True),
        Axis("mean angle error, times the smallest", log=True),
        (*drawn, through("not beaten on average", front, "both")),
        f"solves: {policy}",
    )


def _middle(label: str, cloud: Sequence[Point]) -> Point:
    """Return the geometric mean of a cloud of points."""
    x, y = (float(np.exp(np.mean(np.log([p[k] for p in cloud])))) for k in (0, 1))
    return Point(x, y, label)


def _beats(one: Point, other: Point) -> bool:
    return one.x <= other.x and one.y <= other.y and one[:2] != other[:2]


def _figures(record: Record) -> tuple[float, float] | None:
    """Return seconds and mean distortion; None unless both are known and positive."""
    outcome = record.outcome
    error = outcome.metrics.get(METRIC)
    if outcome.status != "ok" or not outcome.median_seconds or not error:
        return None
    return outcome.median_seconds, float(error)
