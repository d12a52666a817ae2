"""The conformal energy after each iteration of CEM."""

from __future__ import annotations

from cembench.report.content.evidence import Evidence, MeasuredSurface, model_surface
from cembench.report.document import Gap
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries


def energy_by_iteration(evidence: Evidence) -> tuple[Plot | None, list[Gap]]:
    """Return the plot of the paper's models in the run, and a gap for each missing one."""
    panels = []
    gaps = []
    wanted = evidence.paper.plotted("energy_by_iteration")
    for model in wanted.models:
        surface = evidence.surface_for_model(model)
        panel = surface and history_panel(evidence, surface, f"{model} ({surface.origin})")
        if panel:
            panels.append(panel)
        else:
            gaps.append(model_gap(evidence, model, wanted.figure))
    if not panels:
        return None, gaps
    plot = Plot(
        wanted.anchor,
        "Conformal energy against iterations of CEM",
        tuple(panels),
        "E_C at the start (0) and after each iteration. The last value need not be the smallest: "
        "CEM's iteration ends after the first step that does not lower E_C by the tolerance. "
        "Curves other than CEM's are not in the paper.",
        "For each surface, a curve of the conformal energy that falls with the iterations.",
        wanted.figure,
    )
    return plot, gaps


def history_panel(evidence: Evidence, surface: MeasuredSurface, title: str) -> PlotPanel | None:
    """Return a panel of the energies of CEM's iterations on a surface; None if there are none.

    CEM with other parameters, and algorithms not in the paper that report E_C after each iteration,
    have their own curves.
    """
    shown = []
    for series in evidence.disk_series:
        record = evidence.find(surface, series)
        if not record or not record.outcome.energy_history:
            continue
        is_cem = series.algorithm == evidence.reference
        if not is_cem and (
            series.algorithm in evidence.paper.algorithms or "energy_of" in record.outcome.extras
        ):
            continue
        history = record.outcome.energy_history
        look = evidence.styles[series.label]
        shown.append(PlotSeries(series.label, list(range(len(history))), history, "both", look))
        if is_cem and series.main:
            shown.insert(0, shown.pop())
    main = evidence.series_of(evidence.reference)
    if not main or not any(s.name == main.label for s in shown):
        return None
    return PlotPanel(Axis("iteration"), Axis("conformal energy E_C"), tuple(shown), title)


def model_gap(evidence: Evidence, model: str, figure: str) -> Gap:
    """Return the gap for a model without a map by CEM in the run."""
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(evidence.reference)
    record = evidence.find(surface, series) if surface and series else None
    why = (
        evidence.missing_reason(record)
        if surface
        else "no surface of this run is or stands in for it"
    )
    return Gap(
        f"{figure}: {model}",
        f"no map of {model} by CEM: {why}.",
        f"cembench run --surfaces {model_surface(model)} -a cem -o {evidence.store.folder}",
    )
