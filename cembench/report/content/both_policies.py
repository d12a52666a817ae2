"""What a run measured under both linear-algebra policies."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.content.printed_beside_measured import significant
from cembench.report.document import Value

BOTH = ("reuse", "backslash")


def has_both_policies(evidence: Evidence) -> bool:
    """Whether the run measured both policies."""
    return all(policy in evidence.policies for policy in BOTH)


def seconds_under(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> tuple[Value, float | None]:
    """Return a cell's seconds under a policy, as a value and as a number."""
    record = evidence.find(surface, series, policy)
    if record is None or record.outcome.status != "ok" or record.outcome.median_seconds is None:
        key = record.cell.key if record else ""
        text = record.outcome.status if record and record.outcome.status != "ok" else "-"
        return Value(text, None, "", key, evidence.missing_reason(record)), None
    seconds = record.outcome.median_seconds
    return Value(significant(seconds), seconds, surface.origin, record.cell.key), seconds
