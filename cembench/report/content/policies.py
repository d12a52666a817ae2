"""The linear algebra of a run: its work, counted, and times under both policies."""

from __future__ import annotations

from cembench.core.names import slug
from cembench.report.by_surface import POLICIES, policy_suffix
from cembench.report.content.evidence import DISK, Evidence
from cembench.report.declared import declared_table
from cembench.report.document import Gap, Table
from cembench.results.columns import counted
from cembench.results.frame import filled

BOTH = tuple(POLICIES)


def one_policy_gap(evidence: Evidence) -> Gap:
    """Return the gap of a run with only one policy."""
    other = next(policy for policy in BOTH if policy not in evidence.policies)
    return Gap(
        "Factorisations reused or repeated",
        f"this run has only one linear-algebra policy: {', '.join(evidence.policies)}.",
        f"the same `cembench run` with --solves reuse,backslash (missing here: {other})",
    )


def work_tables(evidence: Evidence) -> list[Table]:
    """Return a table of factorisations and solves for each policy whose records hold counts."""
    tables = []
    for policy in evidence.policies:
        own = [record for record in evidence.records if record.cell.solves == policy]
        if any(map(counted, own)):
            known = {"policy": policy, **evidence.paper.functions()}
            notes = (filled(note, evidence.frame, known) for note in evidence.paper.work_notes)
            made = declared_table(
                evidence,
                "linear-algebra-work",
                policy=policy,
                surfaces=evidence.surfaces,
                notes=list(filter(None, notes)),
                called=f"linear-algebra-work-{policy}",
            )
            tables += [made] if made else []
    return tables


def sure_speedups(evidence: Evidence, policy: str) -> list[Table]:
    """Return a table for each target on the certainty of speedups, where rounds are comparable."""
    frame, tables = evidence.frame, []
    for target in evidence.targets:
        base = evidence.reference_to(target)
        other = target != DISK
        made = declared_table(
            evidence,
            "sure-speedups",
            called=f"sure-speedups{policy_suffix(policy, evidence)}{f'-{slug(target)}' * other}",
            policy=policy,
            keys=frame["key"][frame["target"] == target],
            reference=base.label if base else "",
            to=f", {target}" * other,
        )
        tables.append(made)
    return [table for table in tables if table]
