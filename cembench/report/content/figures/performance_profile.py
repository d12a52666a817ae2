"""On what share of the surfaces is an algorithm within a factor of the fastest?

The performance profile of Dolan and More (2002): for each algorithm the share of surfaces on which
its time is at most tau times the best. A cell that did not end ok counts as infinite, so a curve
that stays below 100 % tells of failures.
"""

from __future__ import annotations

from math import inf

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.plots import Axis, Plot, PlotPanel
from cembench.report.plots import PlotSeries as Line


def time_of(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> float | None:
    """Seconds, infinite where the cell did not end ok; None where it is not in the run."""
    record = evidence.find(surface, series, policy)
    if record is None:
        return None
    seconds = record.outcome.median_seconds if record.outcome.status == "ok" else None
    return inf if seconds is None else seconds


def ratios(evidence: Evidence, policy: str) -> tuple[dict[str, list[float]], list[str]]:
    """Time over the best time, by series, on each surface that all were tried on; and which."""
    found: dict[str, list[float]] = {s.label: [] for s in evidence.disk_series}
    used = []
    for surface in evidence.surfaces:
        times = [time_of(evidence, surface, s, policy) for s in evidence.disk_series]
        known = [t for t in times if t is not None]
        if len(known) < len(times) or min(known, default=inf) == inf:
            continue
        used.append(surface.title)
        for series, seconds in zip(evidence.disk_series, known, strict=True):
            found[series.label].append(seconds / min(known))
    return found, used


def performance_profile(evidence: Evidence) -> Plot | None:
    """A panel for each way of solving; None where no surface was tried by two algorithms."""
    panels, counts = [], []
    for policy in evidence.policies:
        found, used = ratios(evidence, policy)
        if not used or len(found) < 2:
            continue
        panels.append(_panel(evidence, found, len(used), policy))
        counts.append(f"{len(used)} of {len(evidence.surfaces)} ({policy})")
    if not panels:
        return None
    return Plot(
        "performance-profile",
        "Performance profiles of the time",
        tuple(panels),
        "Share of the surfaces on which an algorithm takes at most tau times as long as the "
        "fastest; what did not end ok counts as infinitely slow. Only maps to the disk, and only "
        f"surfaces that all of these were tried on: {', '.join(counts)}.",
        "Staircases: the further up and left, the faster on more surfaces.",
    )


def _panel(evidence: Evidence, found: dict[str, list[float]], n: int, policy: str) -> PlotPanel:
    finite = [r for values in found.values() for r in values if r < inf]
    last = 1.15 * max(finite)
    lines = []
    for series in evidence.disk_series:
        ordered = sorted(r for r in found[series.label] if r < inf)
        x = [1.0, *ordered, last]
        y = [100 * sum(r <= tau for r in ordered) / n for tau in x]
        lines.append(Line(series.label, x, y, "steps", evidence.looks[series.label]))
    return PlotPanel(
        Axis("tau, times the fastest", log=True, low=1.0, high=last),
        Axis("surfaces (%)", low=0, high=104),
        tuple(lines),
        f"solves: {policy}, n = {n}",
    )
