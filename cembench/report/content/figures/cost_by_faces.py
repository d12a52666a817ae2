"""Cost of a map against the number of triangles, with fitted exponents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cembench.report.content.evidence import Evidence
from cembench.report.document import Column, Table, Value, count, missing, words
from cembench.report.palette import SeriesStyle, series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries, Point, through
from cembench.results.papers import Paper

#: Minimum number of points for a meaningful exponent.
FEWEST = 3


@dataclass(frozen=True)
class Fit:
    """Seconds = factor * faces ** exponent, fitted to logarithms; `error` is the standard error."""

    exponent: float
    factor: float
    error: float
    n: int


def fit(points: Sequence[Point]) -> Fit | None:
    """Return the power law fitted to (faces, seconds); None for too few or equal sizes."""
    if len(points) < FEWEST or len({p.x for p in points}) < FEWEST:
        return None
    x, y = (np.log([p[k] for p in points]) for k in (0, 1))
    spread = float(((x - x.mean()) ** 2).sum())
    exponent = float(((x - x.mean()) * (y - y.mean())).sum()) / spread
    rest = y - y.mean() - exponent * (x - x.mean())
    error = float(np.sqrt((rest**2).sum() / (len(x) - 2) / spread))
    return Fit(exponent, float(np.exp(y.mean() - exponent * x.mean())), error, len(x))


def measured_points(evidence: Evidence, label: str, policy: str) -> list[Point]:
    """Return (faces, seconds, surface) of every timed cell of a series."""
    series = next(s for s in evidence.series if s.label == label)
    found = []
    for surface in evidence.surfaces:
        record = evidence.find(surface, series, policy)
        if record and record.outcome.status == "ok" and record.outcome.median_seconds:
            found.append(Point(surface.faces, record.outcome.median_seconds, surface.title))
    return found


def printed_points(paper: Paper, algorithm: str) -> list[Point]:
    """Return (faces, seconds, model) as printed in the paper."""
    return [
        Point(paper.faces(model), seconds, model)
        for model, row in paper.tables.get(paper.table_of("seconds") or 0, {}).items()
        if (seconds := row.get(algorithm)) is not None
    ]


def cost_by_faces(evidence: Evidence) -> Plot:
    """Return a plot with a panel for each policy, and one for the printed seconds."""
    panels = []
    for policy in evidence.policies:
        groups = [
            (s.label, evidence.styles[s.label], measured_points(evidence, s.label, policy))
            for s in evidence.disk_series
        ]
        panels.append(_panel(groups, f"measured here, solves: {policy}"))
    paper, figure = evidence.paper, evidence.paper.plotted("cost_by_faces")
    usual = series_styles(paper.algorithms)
    groups = [(a.upper(), usual[a], printed_points(paper, a)) for a in paper.algorithms]
    number = paper.table_of("seconds")
    panels.append(_panel(groups, "printed in the paper" + f" (Table {number})" * bool(number)))
    return Plot(
        figure.anchor or "cost-by-faces",
        "Computational cost against number of triangles",
        tuple(panels),
        "Seconds against triangles on logarithmic axes. Lines are fitted power laws, whose "
        "exponents are in the table below. All surfaces of the run are included, even those not in "
        "the paper; the printed seconds are from a different machine.",
        "Points along straight lines that rise from left to right, one for each algorithm.",
        figure.figure,
    )


def _panel(groups: Sequence[tuple[str, SeriesStyle, list[Point]]], title: str) -> PlotPanel:
    drawn = []
    for label, look, points in groups:
        if not points:
            continue
        drawn.append(through(label, points, "points", look))
        law = fit(points)
        if law:
            ends = [min(p.x for p in points), max(p.x for p in points)]
            line = [law.factor * e**law.exponent for e in ends]
            words = [f"{label}: exponent {law.exponent:.2f}"] * 2
            drawn.append(
                PlotSeries(f"{label}, fitted", ends, line, "line", look, words, named=False)
            )
    return PlotPanel(Axis("triangles", log=True), Axis("seconds", log=True), tuple(drawn), title)


def exponents_table(evidence: Evidence) -> Table:
    """Return a table of the fitted exponents, printed and measured, with standard errors and n."""
    columns = [Column("algorithm", numeric=False)]
    for group in ("printed", *(f"here, {policy}" for policy in evidence.policies)):
        columns += [Column("exponent", group), Column("n", group)]
    rows = []
    for series in evidence.disk_series:
        is_printed = series.algorithm in evidence.paper.algorithms
        printed = fit(printed_points(evidence.paper, series.algorithm)) if is_printed else None
        cells = [words(series.label), *_fit_cells(printed)]
        for policy in evidence.policies:
            cells += _fit_cells(fit(measured_points(evidence, series.label, policy)))
        rows.append(tuple(cells))
    return Table(
        "exponents",
        "Fitted exponents: seconds grow as the number of triangles to this power",
        tuple(columns),
        tuple(rows),
        "Least squares of logarithms; ± one standard error. Iterations also "
        "differ between surfaces.",
        (f"an exponent needs at least {FEWEST} sizes",),
    )


def _fit_cells(law: Fit | None) -> list[Value]:
    if law is None:
        return [missing(f"fewer than {FEWEST} sizes"), missing("no fit")]
    text = f"{law.exponent:.2f} ± {law.error:.2f}"
    return [Value(text, law.exponent, "derived"), count(law.n)]
