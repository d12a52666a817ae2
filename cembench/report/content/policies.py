"""Times under both linear-algebra policies: reuse and backslash."""

from __future__ import annotations

import numpy as np

from cembench.report.content.averages import geometric_rate
from cembench.report.content.both_policies import BOTH, seconds_under
from cembench.report.content.evidence import REFERENCE, Evidence
from cembench.report.content.table_2 import measured_rates
from cembench.report.document import Column, Gap, Table, Value, count, missing, words
from cembench.report.plots import Axis, Plot, PlotPanel
from cembench.report.plots import PlotSeries as Bars


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
    columns = [Column("surface", numeric=False)]
    for series in evidence.series:
        columns += [Column(title, series.label) for title in (*BOTH, "ratio")]
    rows = []
    ratios: dict[str, list[float]] = {s.label: [] for s in evidence.series}
    for surface in evidence.surfaces:
        cells = [words(surface.title)]
        for series in evidence.series:
            (kept, a), (anew, b) = (
                seconds_under(evidence, surface, series, policy) for policy in BOTH
            )
            cells += [kept, anew]
            if a and b:
                ratios[series.label].append(b / a)
                cells.append(Value(f"{b / a:.2f}", b / a, "derived"))
            else:
                cells.append(missing("not measured under both policies"))
        rows.append(tuple(cells))
    means, counts = [words("geometric mean")], [words("n, surfaces counted")]
    for series in evidence.series:
        found = ratios[series.label]
        mean = geometric_rate([r - 1 for r in found]) + 1 if found else None
        value = missing("nothing to average") if mean is None else Value(f"{mean:.2f}", mean)
        means += [words(""), words(""), value]
        counts += [words(""), words(""), count(len(found))]
    return Table(
        "reuse-against-backslash",
        "Seconds with factorisations reused (reuse) or repeated at every solve (backslash)",
        tuple(columns),
        (*rows, tuple(means), tuple(counts)),
        "The ratio shows what an implementation saves by reusing a factorisation, "
        "whatever the algorithm. The paper's MATLAB code factored at every solve.",
        footer_rows=2,
    )


def speedups_table(evidence: Evidence) -> Table:
    """Return a table of CEM's average rates of speedup under both policies."""
    series = [s for s in evidence.disk_series if s.algorithm != REFERENCE and s.main]
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
            rates, _ = measured_rates(evidence, s.algorithm, policy)
            if not rates:
                cells += [missing("no rate"), missing("no rate")]
            else:
                mean, geometric = float(np.mean(rates)), geometric_rate(rates)
                cells += [
                    Value(f"{mean:.2f}", mean, "derived"),
                    Value(f"{geometric:.2f}", geometric, "derived"),
                ]
            cells.append(count(len(rates)))
        rows.append(tuple(cells))
    return Table(
        "speedup-by-policy",
        "Speedup of CEM under both policies: the algorithm, and the reuse of factorisations",
        tuple(columns),
        tuple(rows),
        "Rates of speedup (Eq. 33) on the surfaces that are or stand in for models of the paper.",
    )


def policies_plot(evidence: Evidence) -> Plot:
    """Return a plot of the ratios by surface."""
    drawn = []
    for series in evidence.series:
        names, values = [], []
        for surface in evidence.surfaces:
            a, b = (seconds_under(evidence, surface, series, p)[1] for p in BOTH)
            names.append(surface.title)
            values.append(b / a if a and b else None)
        drawn.append(Bars(series.label, names, values, "both", evidence.styles[series.label]))
    return Plot(
        "reuse-against-backslash",
        "Cost of repeated factorisation",
        (PlotPanel(Axis(""), Axis("backslash over reuse, seconds", log=True), tuple(drawn)),),
        "Ratio of seconds with a factorisation at every solve to seconds with reused ones.",
        "A line for each algorithm over the surfaces; those of iterative algorithms are high.",
    )
