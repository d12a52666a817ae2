"""The figures of a paper, plotted and drawn from a run, and a gap for each that the run lacks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cembench.report.content.evidence import Evidence, model_surface
from cembench.report.content.exhibits import exhibit_gaps
from cembench.report.content.inspection import Inspection
from cembench.report.declared_plots import declared_plot, own_plots
from cembench.report.document import Figure, Gap, Item, Section
from cembench.report.plot_rows import exponents_table
from cembench.report.plots import Plot, drawn
from cembench.results.papers import Picture

Inspections = Mapping[str, Inspection]


def figures_section(evidence: Evidence, seen: Inspections, folder: Path) -> Section:
    """Return the section with the paper's figures."""
    gaps: list[Gap] = []
    items: list[Item] = []
    for picture in evidence.paper.pictures:
        pictures = _pictures(evidence, seen, picture)
        items += pictures
        if not pictures:
            gaps.append(_gap(evidence, seen, picture.model, picture.figure))
    plots: list[Plot | None] = []
    for name in OF_MODELS:
        plots.append(plot := paper_plot(evidence, name, seen))
        gaps += _lacking(evidence, name, plot, seen)
    cost = declared_plot(evidence, "cost-by-faces")
    over = [paper_plot(evidence, name, seen) for name in OVER_MODELS]
    items += drawn([*plots, cost, exponents_table(evidence), *over], folder)
    return Section("figures", "Figures of the paper", (*items, *gaps, *exhibit_gaps(evidence)))


#: Plots of a paper with a panel for each of some models, and of one with all of them.
OF_MODELS = ("energy-by-iteration", "angle-histograms")
OVER_MODELS = ("energy-over-models", "angles-over-models")


def paper_plot(evidence: Evidence, name: str, seen: Inspections) -> Plot | None:
    """Return a plot that the paper declares; None without one, or with nothing to draw."""
    declared = own_plots(evidence).get(name)
    return declared_plot(evidence, name, declared, seen=seen) if declared else None


def _lacking(evidence: Evidence, name: str, plot: Plot | None, seen: Inspections) -> list[Gap]:
    """Return a gap for each model that should have a panel and has none."""
    declared = own_plots(evidence).get(name)
    there = {panel.of for panel in plot.panels} if plot else set()
    models = declared.models if declared else ()
    figure = declared.figure if declared else ""
    return [_gap(evidence, seen, model, figure) for model in models if model not in there]


def _gap(evidence: Evidence, seen: Inspections, model: str, figure: str) -> Gap:
    """Return the gap for a model without a map by CEM in the run, or without the map itself."""
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(evidence.reference)
    record = evidence.find(surface, series) if surface and series else None
    title = f"{figure}: {model}"
    if surface and record and record.outcome.status == "ok" and not seen[surface.mesh_hash].kept:
        return Gap(title, seen[surface.mesh_hash].missing_reason)
    why = (
        evidence.missing_reason(record)
        if surface
        else "no surface of this run is or stands in for it"
    )
    return Gap(
        title,
        f"no map of {model} by {evidence.reference_label}: {why}.",
        f"cembench run --surfaces {model_surface(model)} -a {evidence.reference} "
        f"-o {evidence.store.folder}",
    )


def _pictures(evidence: Evidence, inspections: Inspections, wanted: Picture) -> list[Figure]:
    """Return CEM's pictures of a model, as in the paper."""
    figure, model = wanted.figure, wanted.model
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(evidence.reference)
    if surface is None or series is None:
        return []
    seen = inspections[surface.mesh_hash]
    checkerboard = seen.checkerboards.get(series.label)
    if checkerboard is None:
        return []
    kinds = {"checkerboard": checkerboard, "curvature": seen.curvature, "mesh": seen.mesh}
    chosen = [kinds[kind] for kind in wanted.shows]
    return [
        Figure(
            f"{figure.lower().replace(' ', '-')}-{k + 1}",
            f"{surface.full_title} and its map by {series.label}: {picture.title}",
            picture.files,
            picture.caption,
            alternative=picture.alternative,
            paper=figure,
        )
        for k, picture in enumerate(chosen)
        if picture
    ]
