"""Which algorithms give the best accuracy for their time (Pareto)?"""

from __future__ import annotations

import numpy as np

from cembench.records import Record
from cembench.reporting.content.evidence import Evidence
from cembench.reporting.palette import looks
from cembench.reporting.plots import Axis, Panel, Plot, Series

METRIC = "angle_error_mean_deg"


def accuracy_against_time(evidence: Evidence) -> Plot | None:
    """A point for each cell, relative to the best on its surface, and the middle of each cloud."""
    panels = tuple(p for policy in evidence.policies if (p := _panel(evidence, policy)))
    if not panels:
        return None
    return Plot(
        "accuracy-against-time",
        "Accuracy against time, relative to the best on each surface",
        panels,
        "Right: times as slow as the fastest algorithm on the same surface; up: times the smallest "
        "mean angular distortion there. At (1, 1) an algorithm is best in both. Joined points are "
        "the geometric means of the algorithms that no other one beats in both; maps to the disk "
        "alone.",
        "A cloud of points for each algorithm; the nearer to the lower left corner, the better.",
    )


def _panel(evidence: Evidence, policy: str) -> Panel | None:
    points: dict[str, list[tuple[float, float, str]]] = {s.label: [] for s in evidence.disk_series}
    for surface in evidence.surfaces:
        found = [(s, evidence.find(surface, s, policy)) for s in evidence.disk_series]
        known = [(s.label, *figures) for s, r in found if r and (figures := _figures(r))]
        if len(known) < 2:
            continue
        fastest, finest = (min(k[i] for k in known) for i in (1, 2))
        for label, seconds, error in known:
            points[label].append((seconds / fastest, error / finest, surface.title))
    if not any(points.values()):
        return None
    style = looks([s.algorithm for s in evidence.disk_series])
    drawn, middles = [], []
    for series in evidence.disk_series:
        if cloud := points[series.label]:
            x, y, names = ([p[k] for p in cloud] for k in range(3))
            look = style[series.algorithm]
            label = f"{series.label}"
            drawn.append(Series(label, x, y, "points", look, [str(n) for n in names]))  # type: ignore[arg-type]
            centre = (*(float(np.exp(np.mean(np.log(v)))) for v in (x, y)), series.label)  # type: ignore[arg-type]
            middles.append(centre)
    front = sorted(m for m in middles if not any(_beats(o, m) for o in middles))
    x, y, names = ([m[k] for m in front] for k in range(3))
    drawn.append(Series("not beaten in the mean", x, y, "both", words=[str(n) for n in names]))  # type: ignore[arg-type]
    return Panel(
        Axis("time, times the fastest", log=True),
        Axis("mean angular distortion, times the smallest", log=True),
        tuple(drawn),
        f"solves: {policy}",
    )


def _beats(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    better = one[0] <= other[0] and one[1] <= other[1]
    return better and one[:2] != other[:2]


def _figures(record: Record) -> tuple[float, float] | None:
    """Seconds and mean distortion; None where the cell has not both, above zero."""
    outcome = record.outcome
    error = outcome.metrics.get(METRIC)
    if outcome.status != "ok" or not outcome.median_seconds or not error:
        return None
    return outcome.median_seconds, float(error)
