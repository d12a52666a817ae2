"""Split a table of the paper into up to three: its own, other algorithms, other surfaces.

The paper's four algorithms on its models are shown with the printed figures. Other algorithms that
map to the disk, and other surfaces, have separate tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.content.printed_beside_measured import (
    Footer,
    Quantity,
    absent_models,
    in_policy,
    policy_suffix,
    table_beside,
)
from cembench.report.document import Table

#: Returns the quantities of an algorithm; the second argument is its column in the paper, or None.
Quantities = Callable[[AlgorithmSeries | None, str | None], Sequence[Quantity]]


def tables_of_kind(
    evidence: Evidence,
    number: int,
    title: str,
    quantities: Quantities,
    *,
    policy: str | None = None,
    caption: str = "",
    footers: Sequence[Footer] = (),
    algorithms: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> list[Table]:
    """Return the paper's table `number`, then other algorithms and other surfaces, if any."""
    known = evidence.paper.algorithms
    algorithms = algorithms or known
    tail = policy_suffix(policy, evidence) if policy else ""
    add = in_policy(evidence, policy) if policy else ""
    name = f"table-{number}{tail}"
    tables = []
    if evidence.models:
        left_out = absent_models(evidence)
        absent = f"not in this run: {', '.join(left_out)}" if left_out else ""
        columns = [q for a in algorithms for q in quantities(evidence.series_of(a), a)]
        tables.append(
            table_beside(
                evidence, name, f"Table {number}: {title}{add}", evidence.models, columns,
                policy=policy, caption=caption, footers=footers, notes=notes, absent=absent,
            )
        )  # fmt: skip
    others = [s for s in evidence.disk_series if not (s.algorithm in known and s.main)]
    if evidence.models and others:
        columns = [q for s in others for q in quantities(s, None)]
        tables.append(
            table_beside(
                evidence, f"{name}-other-algorithms",
                f"{_capitalised(title)}: algorithms that are not in the paper{add}",
                evidence.models, columns,
                policy=policy, footers=footers,
            )
        )  # fmt: skip
    if evidence.others:
        columns = [
            q
            for s in evidence.disk_series
            if s.algorithm in algorithms or s.algorithm not in known
            for q in quantities(s, None)
        ]
        tables.append(
            table_beside(
                evidence, f"{name}-other-surfaces",
                f"{_capitalised(title)}: surfaces that are not in the paper{add}",
                evidence.others, columns,
                policy=policy, footers=footers,
            )
        )  # fmt: skip
    return tables


def _capitalised(title: str) -> str:
    return title[0].upper() + title[1:]
