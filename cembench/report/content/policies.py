"""The linear algebra of a run: its work, counted, and times under both policies."""

from __future__ import annotations

from cembench.report.by_surface import MEAN_RATIO, POLICIES, Quantity, policy_suffix, table_beside
from cembench.report.content.evidence import Evidence
from cembench.report.declared import declared_table
from cembench.report.document import Gap, Table
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
                policy=policy,
                surfaces=evidence.surfaces,
                notes=list(filter(None, told)),
                called=f"linear-algebra-work-{policy}",
            )
            tables += [made] if made else []
    return tables


def sure_speedups(evidence: Evidence, policy: str) -> list[Table]:
    """Return a table on the certainty of the speedups; none without comparable rounds."""
    called = f"sure-speedups{policy_suffix(policy, evidence)}"
    made = declared_table(evidence, "sure-speedups", called=called, policy=policy)
    return [made] if made else []
