"""Times under both linear-algebra policies: reuse and backslash."""

from __future__ import annotations

from cembench.report.content.averages import geometric_rate, mean_rate
from cembench.report.content.both_policies import BOTH, seconds_under
from cembench.report.content.evidence import (
    AlgorithmSeries,
    Evidence,
    MeasuredSurface,
)
from cembench.report.content.printed_beside_measured import (
    Footer,
    Quantity,
    geometric_mean,
    table_beside,
)
from cembench.report.content.rates import measured_rates
from cembench.report.document import Column, Gap, Table, count, entry, words
from cembench.report.plots import Axis, Plot, PlotPanel
from cembench.report.plots import PlotSeries as Bars
from cembench.results.columns import COLUMNS, FrameColumn
from cembench.results.records import Record


def one_policy_gap(evidence: Evidence) -> Gap:
    """Return the gap of a run with only one policy."""
    other = next(policy for policy in BOTH if policy not in evidence.policies)
    return Gap(
        "Factorisations reused or repeated",
        f"this run has only one linear-algebra policy: {', '.join(evidence.policies)}.",
        f"the same `cembench run` with --solves reuse,backslash (missing here: {other})",
    )


def policies_table(evidence: Evidence) -> Table:
    """Return a table of seconds under both policies and their ratio, for every algorithm."""
    surfaces = {surface.mesh_hash: surface for surface in evidence.surfaces}
    quantities = []
    for series in evidence.series:

        def ratio(record: Record, series: AlgorithmSeries = series) -> float | None:
            return _ratio(evidence, surfaces[record.cell.mesh_hash], series)

        of_ratio = FrameColumn("ratio", ratio, form=".2f", lacking="not under both policies")
        seconds = COLUMNS["seconds"]
        quantities += [Quantity(series.label, series, seconds, title=p, policy=p) for p in BOTH]
        quantities.append(Quantity(series.label, series, of_ratio, title="ratio", policy=BOTH[0]))
    mean = Footer("geometric mean", geometric_mean, lambda mean: f"{mean:.2f}", ("ratio",))
    return table_beside(
        evidence,
        "reuse-against-backslash",
        "Seconds with factorisations reused (reuse) or repeated at every solve (backslash)",
        evidence.surfaces,
        quantities,
        caption="The ratio shows what an implementation saves by reusing a factorisation, "
        "whatever the algorithm. The paper's MATLAB code factored at every solve.",
        footers=(mean,),
    )


def _ratio(evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries) -> float | None:
    """Return the seconds with a factorisation at every solve over those with reused ones."""
    kept, anew = (seconds_under(evidence, surface, series, policy) for policy in BOTH)
    return anew / kept if kept and anew else None


def speedups_table(evidence: Evidence) -> Table:
    """Return a table of CEM's average rates of speedup under both policies."""
    series = [s for s in evidence.disk_series if s.algorithm != evidence.reference and s.main]
    columns = [Column("CEM over", numeric=False)]
    for policy in BOTH:
        columns += [
            Column("mean rate", policy),
            Column("geometric mean - 1", policy),
            Column("n", policy),
        ]
    rows = []
    for s in series:
        cells = [words(s.label)]
        for policy in BOTH:
            rates = list(measured_rates(evidence, s.algorithm, policy).values())
            for mean in (mean_rate, geometric_rate):
                cells.append(entry(mean(rates) if rates else None, ".2f", "no rate"))
            cells.append(count(len(rates)))
        rows.append(tuple(cells))
    return Table(
        "speedup-by-policy",
        "Speedup of CEM under both policies: the algorithm, and the reuse of factorisations",
        tuple(columns),
        tuple(rows),
        "Rates of speedup on the surfaces that are or stand in for models of the paper.",
    )


def policies_plot(evidence: Evidence) -> Plot:
    """Return a plot of the ratios by surface."""
    drawn = []
    for series in evidence.series:
        names = [surface.title for surface in evidence.surfaces]
        values = [_ratio(evidence, surface, series) for surface in evidence.surfaces]
        drawn.append(Bars(series.label, names, values, "both", evidence.styles[series.label]))
    return Plot(
        "reuse-against-backslash",
        "Cost of repeated factorisation",
        (PlotPanel(Axis(""), Axis("backslash over reuse, seconds", log=True), tuple(drawn)),),
        "Ratio of seconds with a factorisation at every solve to seconds with reused ones.",
        "A line for each algorithm over the surfaces; those of iterative algorithms are high.",
    )
