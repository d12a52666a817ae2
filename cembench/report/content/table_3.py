"""Table 3: the conformal energy of the maps."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.content.paper_table import tables_of_kind
from cembench.report.content.printed_beside_measured import Quantity, metric
from cembench.report.document import Table


def table_3(evidence: Evidence) -> list[Table]:
    """Return the table of conformal energies, which do not depend on the policy."""
    words = evidence.paper.printed[3]
    return tables_of_kind(evidence, 3, words.title, _quantities, caption=words.caption)


def _quantities(series: AlgorithmSeries | None, column: str | None) -> list[Quantity]:
    title = series.label if series else str(column).upper()
    place = (3, column) if column else None
    energy = metric("conformal_energy")
    return [Quantity(title, series, energy, lambda x: f"{x:.4f}", place, digits=4)]
