"""Performance profile of the time.

The performance profile of Dolan and More (2002) shows, for each algorithm, the share of surfaces on
which its time is at most tau times the best. A cell that did not end ok counts as infinite, and so
does a map whose angles are not as good as the best on that surface; both keep a curve below 100 %.
Variants that were tried on fewer surfaces than the others are left out, because only surfaces tried
by all are compared.
"""

from __future__ import annotations

from math import inf

from cembench.report.content.as_good import AS_GOOD, DEGREES, as_good
from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.plots import Axis, Plot, PlotPanel
from cembench.report.plots import PlotSeries as Line
from cembench.results.records import Record


def time_of(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> float | None:
    """Return the seconds of a good map, else infinity; None if the cell is not in the run."""
    record = evidence.find(surface, series, policy)
    if record is None:
        return None
    seconds = record.outcome.median_seconds
    error = _angle(record)
    good = error < inf and as_good([error], [_best_angle(evidence, surface, policy)])
    return seconds if good and seconds is not None else inf


def _angle(record: Record) -> float:
    """Return the mean angle error in degrees; infinite if the cell did not end ok."""
    error = record.outcome.metrics.get("angle_error_mean_deg")
    return inf if record.outcome.status != "ok" or error is None else float(error)


def _best_angle(evidence: Evidence, surface: MeasuredSurface, policy: str) -> float:
    found = [evidence.find(surface, s, policy) for s in evidence.disk_series]
    return min((_angle(record) for record in found if record is not None), default=inf)


def shown_series(evidence: Evidence, policy: str) -> tuple[AlgorithmSeries, ...]:
    """Return the series to compare; variants only if tried on as many surfaces as others."""
    tried = {
        s.label: sum(evidence.find(surface, s, policy) is not None for surface in evidence.surfaces)
        for s in evidence.disk_series
    }
    least = min((tried[s.label] for s in evidence.disk_series if s.main), default=0)
    return tuple(s for s in evidence.disk_series if s.main or tried[s.label] >= least)


def ratios(evidence: Evidence, policy: str) -> tuple[dict[str, list[float]], list[str]]:
    """Return time over best time by series, on the surfaces tried by all, and these surfaces."""
    shown = shown_series(evidence, policy)
    found: dict[str, list[float]] = {s.label: [] for s in shown}
    used = []
    for surface in evidence.surfaces:
        times = [time_of(evidence, surface, s, policy) for s in shown]
        known = [t for t in times if t is not None]
        if len(known) < len(times) or min(known, default=inf) == inf:
            continue
        used.append(surface.title)
        for series, seconds in zip(shown, known, strict=True):
            found[series.label].append(seconds / min(known))
    return found, used


def performance_profile(evidence: Evidence) -> Plot | None:
    """Return a plot with a panel for each policy; None if no two algorithms share a surface."""
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
        "fastest. A cell that did not end ok counts as infinitely slow, and so does a map whose "
        f"mean angle error is more than {AS_GOOD} times the smallest on that surface and more than "
        f"{DEGREES} degrees above it. Only maps to the disk are compared, on the surfaces that all "
        f"of these algorithms were tried on: {', '.join(counts)}.{_left_out(evidence)}",
        "Staircases: the further up and left, the faster on more surfaces.",
    )


def _left_out(evidence: Evidence) -> str:
    shown = {s.label for policy in evidence.policies for s in shown_series(evidence, policy)}
    names = [s.label for s in evidence.disk_series if s.label not in shown]
    return f" Left out, as they were tried on fewer surfaces: {', '.join(names)}." if names else ""


def _panel(evidence: Evidence, found: dict[str, list[float]], n: int, policy: str) -> PlotPanel:
    finite = [r for values in found.values() for r in values if r < inf]
    last = 1.15 * max(finite)
    lines = []
    for series in (s for s in evidence.disk_series if s.label in found):
        ordered = sorted(r for r in found[series.label] if r < inf)
        x = [1.0, *ordered, last]
        y = [100 * sum(r <= tau for r in ordered) / n for tau in x]
        lines.append(Line(series.label, x, y, "steps", evidence.styles[series.label]))
    return PlotPanel(
        Axis("tau, times the fastest", log=True, low=1.0, high=last),
        Axis("surfaces (%)", low=0, high=104),
        tuple(lines),
        f"solves: {policy}, n = {n}",
    )
