"""Performance profiles of accuracy.

These are performance profiles (Dolan and More, 2002) of figures of merit instead of seconds. A cell
that did not end ok counts as infinitely bad. Angles and |mu| do not depend on the gauge, so maps to
the disk and maps with a free boundary are compared; E_C is that of disks in the common gauge.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from cembench.report.content.evidence import DISK, AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries

#: Larger factors are not distinguished.
FARTHEST = 100.0
#: Smaller figures count as this much; below it, ratios are rounding.
SMALLEST = 1e-9


@dataclass(frozen=True)
class _Panel:
    """A figure of merit, and the targets of the compared maps."""

    metric: str
    title: str
    targets: tuple[str, ...]


_PANELS = (
    _Panel("angle_error_mean_deg", "mean angle error", (DISK, "free boundary")),
    _Panel("beltrami_area_mean", "mean |mu|", (DISK, "free boundary")),
    _Panel("common_gauge_energy", "E_C in the common gauge", (DISK,)),
    _Panel("angle_error_mean_deg", "mean angle error, surfaces with holes", ("circular holes",)),
)


def accuracy_profiles(evidence: Evidence, policy: str) -> Plot | None:
    """Return a plot with a panel per figure of merit; None if no algorithms share surfaces."""
    panels = [p for wanted in _PANELS if (p := _panel(evidence, policy, wanted))]
    if not panels:
        return None
    return Plot(
        "accuracy-profiles",
        "Performance profiles of accuracy",
        tuple(panels),
        "Share of the surfaces on which an algorithm's figure is at most tau times the best one "
        "there. A cell that did not end ok counts as infinitely bad, so a curve ends at the "
        "success rate. Only surfaces (n) that all algorithms of a panel were tried on are "
        f"included; factors above {FARTHEST:g} are not distinguished.",
        "Staircases: the further up and left, the more accurate on more surfaces.",
    )


def _panel(evidence: Evidence, policy: str, wanted: _Panel) -> PlotPanel | None:
    series = [s for s in evidence.series if s.main and s.target in wanted.targets]
    ratios: dict[str, list[float]] = {s.label: [] for s in series}
    n = 0
    for surface in evidence.surfaces:
        figures = [figure(evidence, surface, s, policy, wanted.metric) for s in series]
        known = [f for f in figures if f is not None]
        if len(known) < max(2, len(figures)) or min(known) == inf:
            continue
        n += 1
        best = max(min(known), SMALLEST)
        for one, value in zip(series, known, strict=True):
            ratios[one.label].append(max(value, SMALLEST) / best)
    if not n:
        return None
    last = min(FARTHEST, 1.15 * max(r for found in ratios.values() for r in found if r < inf))
    lines = []
    for one in series:
        ordered = sorted(r for r in ratios[one.label] if r <= last)
        x = [1.0, *ordered, last]
        y = [100 * sum(r <= tau for r in ordered) / n for tau in x]
        lines.append(PlotSeries(one.label, x, y, "steps", evidence.styles[one.label]))
    return PlotPanel(
        Axis("tau, times the best", log=True, low=1.0, high=max(last, 1.01)),
        Axis("surfaces (%)", low=0, high=104),
        tuple(lines),
        f"{wanted.title}, n = {n}",
    )


def figure(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str, metric: str
) -> float | None:
    """Return a figure of a map; infinite if the cell did not end ok, None if not tried."""
    record = evidence.find(surface, series, policy)
    if record is None:
        return None
    found = record.outcome.metrics.get(metric)
    return inf if record.outcome.status != "ok" or found is None else float(found)
