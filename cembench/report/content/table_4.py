"""Table 4: mean and standard deviation of the angular distortion in degrees."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.content.paper_table import tables_of_kind
from cembench.report.content.printed_beside_measured import Quantity, metric
from cembench.report.document import Table


def table_4(evidence: Evidence) -> list[Table]:
    """Return the table of means and standard deviations of angular distortions."""
    words = evidence.paper.printed[4]
    return tables_of_kind(evidence, 4, words.title, _quantities, caption=words.caption)


def _quantities(series: AlgorithmSeries | None, column: str | None) -> list[Quantity]:
    title = series.label if series else str(column).upper()
    return [
        Quantity(
            f"{title} {heading}",
            series,
            metric(f"angle_error_{what}_deg"),
            lambda x: f"{x:.2f}",
            (4, f"{column}_{what}") if column else None,
        )
        for heading, what in (("mean", "mean"), ("SD", "sd"))
    ]
