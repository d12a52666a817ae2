"""Table 1: seconds of a map, and iterations of CEM."""

from __future__ import annotations

from cembench.report.content.evidence import REFERENCE, AlgorithmSeries, Evidence
from cembench.report.content.paper_table import tables_of_kind
from cembench.report.content.printed_beside_measured import POLICIES, Quantity, significant
from cembench.report.document import Table


def table_1(evidence: Evidence) -> list[Table]:
    """Return the table of seconds and iterations for each policy of the run."""
    tables = []
    for policy in evidence.policies:
        caption = f"{evidence.paper.printed[1].caption} Here {POLICIES.get(policy, policy)}."
        tables += tables_of_kind(
            evidence,
            1,
            evidence.paper.printed[1].title,
            _quantities,
            policy=policy,
            caption=caption,
        )
    return tables


def _quantities(series: AlgorithmSeries | None, column: str | None) -> list[Quantity]:
    title = series.label if series else str(column).upper()
    seconds = Quantity(
        title,
        series,
        lambda record: record.outcome.median_seconds,
        significant,
        (1, column) if column else None,
        timed=True,
    )
    if column != REFERENCE:
        return [seconds]
    iterations = Quantity(
        f"{title} iterations",
        series,
        lambda record: record.outcome.iterations,
        lambda number: f"{number:.0f}",
        (1, "cem_iterations"),
        digits=0,
    )
    return [seconds, iterations]
