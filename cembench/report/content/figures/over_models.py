"""Energy, and mean and SD of the angular distortion, by model."""

from __future__ import annotations

from collections.abc import Callable

from cembench.report.content.evidence import Evidence
from cembench.report.palette import series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries


def energy_over_models(evidence: Evidence) -> Plot:
    """Return the plot of the conformal energy of every algorithm on every model of the run."""
    figure = evidence.paper.plotted("energy_over_models")
    axis = Axis("conformal energy E_C", log=True)
    return Plot(
        figure.anchor,
        "Conformal energy over the models",
        _pair(evidence, "conformal_energy", axis, 3, lambda a: a),
        "Left: this run's surfaces. Right: as printed for the models they are or stand in for.",
        "A line for each algorithm over the models; the lines are close together.",
        figure.figure,
    )


def angles_over_models(evidence: Evidence) -> Plot:
    """Return the plot of the mean and SD of the angular distortion on every model of the run."""
    figure = evidence.paper.plotted("angles_over_models")
    panels: tuple[PlotPanel, ...] = ()
    for what, words in (("mean", "mean"), ("sd", "SD")):
        axis = Axis(f"{words} of angular distortion (degrees)", log=True)
        column = _column(what)
        panels += _pair(evidence, f"angle_error_{what}_deg", axis, 4, column)
    return Plot(
        figure.anchor,
        "Mean and standard deviation of the angular distortion over the models",
        panels,
        "Top: mean; bottom: standard deviation. Left: measured here; right: as printed.",
        "A line for each algorithm over the models.",
        figure.figure,
    )


def _column(what: str) -> Callable[[str], str]:
    return lambda algorithm: f"{algorithm}_{what}"


def _pair(
    evidence: Evidence, metric: str, axis: Axis, table: int, column: Callable[[str], str]
) -> tuple[PlotPanel, PlotPanel]:
    """Return the measured and the printed panel for the same models."""
    paper = evidence.paper
    style = series_styles(paper.algorithms)
    measured, printed = [], []
    for algorithm in paper.algorithms:
        series = evidence.series_of(algorithm)
        names = [s.title for s in evidence.models]
        values = []
        for surface in evidence.models:
            record = evidence.find(surface, series) if series else None
            ok = record is not None and record.outcome.status == "ok"
            values.append(record.outcome.metrics.get(metric) if record and ok else None)
        title = series.title if series else algorithm.upper()
        if series:
            measured.append(PlotSeries(title, names, values, "both", style[algorithm]))
        rows = [paper.tables[table][s.paper_row][column(algorithm)] for s in evidence.models]
        printed.append(PlotSeries(title, names, rows, "both", style[algorithm], named=not series))
    origins = sorted({s.origin for s in evidence.models})
    return (
        PlotPanel(Axis(""), axis, tuple(measured), f"measured here ({', '.join(origins)})"),
        PlotPanel(Axis(""), axis, tuple(printed), "printed in the paper"),
    )
