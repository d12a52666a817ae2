"""What a run measured under both linear-algebra policies."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface

BOTH = ("reuse", "backslash")


def has_both_policies(evidence: Evidence) -> bool:
    """Whether the run measured both policies."""
    return all(policy in evidence.policies for policy in BOTH)


def seconds_under(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> float | None:
    """Return a cell's seconds under a policy; None if it has none."""
    record = evidence.find(surface, series, policy)
    ok = record is not None and record.outcome.status == "ok"
    return record.outcome.median_seconds if record and ok else None
