"""Times under both linear-algebra policies: reuse and backslash."""

from __future__ import annotations

from cembench.report.content.averages import geometric_rate, mean_rate
from cembench.report.content.evidence import (
    Evidence,
)
from cembench.report.content.printed_beside_measured import (
    Footer,
    Quantity,
    geometric_mean,
    table_beside,
)
from cembench.report.content.rates import measured_rates
from cembench.report.document import Column, Gap, Table, count, entry, words
from cembench.results.columns import COLUMNS, FrameColumn
from cembench.results.records import Record

BOTH = ("reuse", "backslash")


def has_both_policies(evidence: Evidence) -> bool:
    """Whether the run measured both policies."""
    return all(policy in evidence.policies for policy in BOTH)


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
    frame = evidence.frame
    known = frame[frame["ok"]].pivot(
        index=["mesh_hash", "label"], columns="solves", values="seconds"
    )
    ratios = (known[BOTH[1]] / known[BOTH[0]]).dropna().to_dict()
    quantities = []
    for series in evidence.series:

        def ratio(record: Record, label: str = series.label) -> float | None:
            return ratios.get((record.cell.mesh_hash, label))

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
