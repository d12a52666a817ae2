"""Time of a call by phase."""

from __future__ import annotations

from collections.abc import Sequence

from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.palette import PARTS, REST, SeriesStyle
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries
from cembench.results.records import Record


def time_by_phase(evidence: Evidence) -> Plot | None:
    """Return a plot of the mean shares of time by phase, one bar per algorithm."""
    panels = []
    for policy in evidence.policies:
        bars = []
        for series in evidence.series:
            records = [evidence.find(s, series, policy) for s in evidence.surfaces]
            shares = [_shares(r) for r in records if r is not None and r.outcome.phases]
            if shares:
                names = dict.fromkeys(name for share in shares for name in share)
                mean = {n: sum(s.get(n, 0.0) for s in shares) / len(shares) for n in names}
                bars.append((f"{series.label} (n={len(shares)})", mean))
        if bars:
            axis = Axis("share of the time (%)", low=0, high=100)
            panels.append(PlotPanel(Axis(""), axis, _stacked(bars), f"solves: {policy}"))
    if not panels:
        return None
    return Plot(
        "time-by-phase",
        "Time by phase",
        tuple(panels),
        "Shares of the measured time, which the phases add up to; the mean over the "
        "surfaces of the run (n).",
        "A bar for each algorithm, divided into its phases.",
    )


def phases_panel(evidence: Evidence, surface: MeasuredSurface, policy: str) -> PlotPanel | None:
    """Return a panel of seconds by phase on one surface; None if nothing was timed."""
    found = [(s, evidence.find(surface, s, policy)) for s in evidence.series]
    bars = [(s.label, r.outcome.phases) for s, r in found if r and r.outcome.phases]
    if not bars:
        return None
    return PlotPanel(Axis(""), Axis("seconds"), _stacked(bars), f"time by phase, solves: {policy}")


def _shares(record: Record) -> dict[str, float]:
    total = sum(record.outcome.phases.values()) or 1.0
    return {name: 100 * seconds / total for name, seconds in record.outcome.phases.items()}


def _stacked(bars: Sequence[tuple[str, dict[str, float]]]) -> tuple[PlotSeries, ...]:
    """Return a series for each phase, the largest first; the remainder is last."""
    total: dict[str, float] = {}
    for _, phases in bars:
        for name, value in phases.items():
            total[name] = total.get(name, 0.0) + value
    order = sorted(total, key=lambda name: (name == "other", -total[name], name))
    labels = [label for label, _ in bars]
    return tuple(
        PlotSeries(
            name, labels, [phases.get(name, 0.0) for _, phases in bars], "stack", colour_of(name)
        )
        for name in order
    )


#: Colours of phases, the same in every plot.
_KNOWN = (
    "solves",
    "factorisation",
    "assembly",
    "laplacian",
    "ordering",
    "symbolic",
    "boundary",
    "beltrami",
    "boundary step",
    "folds",
    "energy",
    "start",
)


def colour_of(phase: str) -> SeriesStyle:
    """Return the colour of a phase; the remainder and phases of plug-ins are grey."""
    return SeriesStyle(PARTS[_KNOWN.index(phase)] if phase in _KNOWN else REST)
