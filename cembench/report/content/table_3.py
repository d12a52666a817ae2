"""Table 3: the conformal energy of the maps."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.content.paper_table import tables_of_kind
from cembench.report.content.printed_beside_measured import Quantity, metric
from cembench.report.document import Table

CAPTION = (
    "E_C = E_D - A (Eq. 7) is zero for a conformal map; A is the area enclosed by the image of the "
    "boundary (Eq. 8). It does not depend on the machine, but on the mesh: a stand-in has a "
    "different value than the paper's model."
)


def table_3(evidence: Evidence) -> list[Table]:
    """Return the table of conformal energies, which do not depend on the policy."""
    return tables_of_kind(evidence, 3, "conformal energy", _quantities, caption=CAPTION)


def _quantities(series: AlgorithmSeries | None, column: str | None) -> list[Quantity]:
    title = series.label if series else str(column).upper()
    place = (3, column) if column else None
    energy = metric("conformal_energy")
    return [Quantity(title, series, energy, lambda x: f"{x:.4f}", place, digits=4)]
