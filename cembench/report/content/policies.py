"""The linear algebra of a run: its work, counted, and times under both policies."""

from __future__ import annotations

from cembench.report.by_surface import MEAN_RATIO, POLICIES, Quantity, table_beside
from cembench.report.content.evidence import Evidence
from cembench.report.content.printed_tables import GEOMETRIC_RATE, MEAN_RATE, measured_rates
from cembench.report.declared import declared_table
from cembench.report.document import Column, Gap, Table, count, words
from cembench.results.columns import COLUMNS, FrameColumn, counted
from cembench.results.frame import filled
from cembench.results.records import Record

REUSE, BACKSLASH = BOTH = tuple(POLICIES)


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
    ratios = (known[BACKSLASH] / known[REUSE]).dropna().to_dict()
    quantities = []
    for series in evidence.series:

        def ratio(record: Record, label: str = series.label) -> float | None:
            return ratios.get((record.cell.mesh_hash, label))

        of_ratio = FrameColumn("ratio", ratio, form=".2f", lacking="not under both policies")
        seconds = COLUMNS["seconds"]
        quantities += [Quantity(series.label, series, seconds, title=p, policy=p) for p in BOTH]
        quantities.append(Quantity(series.label, series, of_ratio, title="ratio", policy=REUSE))
    return table_beside(
        evidence,
        "reuse-against-backslash",
        "Seconds with factorisations reused (reuse) or repeated at every solve (backslash)",
        evidence.surfaces,
        quantities,
        caption="The ratio shows what an implementation saves by reusing a factorisation, "
        "whatever the algorithm. The paper's MATLAB code factored at every solve.",
        footers=(MEAN_RATIO,),
    )


def speedups_table(evidence: Evidence) -> Table:
    """Return a table of the reference's average rates of speedup under both policies."""
    titles = ("mean rate", "geometric mean - 1", "n")
    columns = [Column(title, policy) for policy in BOTH for title in titles]
    rows, label = [], evidence.reference_label
    for s in evidence.disk_series:
        if s.algorithm == evidence.reference or not s.main:
            continue
        cells = [words(s.label)]
        for policy in BOTH:
            rates = list(measured_rates(evidence, s.algorithm, policy).values())
            for mean in (MEAN_RATE, GEOMETRIC_RATE):
                cells.append(mean.model_copy(update={"form": ".2f"}).entry(rates, "no rate"))
            cells.append(count(len(rates)))
        rows.append(tuple(cells))
    return Table(
        "speedup-by-policy",
        f"Speedup of {label} under both policies: the algorithm, and the reuse of factorisations",
        (Column(f"{label} over", numeric=False), *columns),
        tuple(rows),
        "Rates of speedup on the surfaces that are or stand in for models of the paper.",
    )


def work_tables(evidence: Evidence) -> list[Table]:
    """Return a table of factorisations and solves for each policy whose records hold counts."""
    tables = []
    for policy in evidence.policies:
        own = [record for record in evidence.records if record.cell.solves == policy]
        if any(map(counted, own)):
            known = {"policy": policy, **evidence.paper.functions()}
            told = (filled(note, evidence.frame, known) for note in evidence.paper.work_notes)
            made = declared_table(
                evidence,
                "linear-algebra-work",
                keys=[record.cell.key for record in own],
                surfaces=evidence.surfaces,
                notes=list(filter(None, told)),
                called=f"linear-algebra-work-{policy}",
            )
            tables += [made] if made else []
    return tables
