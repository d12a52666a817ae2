"""A paper's tables: printed figures beside measured ones, and tables of what is not in the paper.

The paper's four algorithms on its models are shown with the printed figures. Other algorithms that
map to the disk, and other surfaces, have separate tables.
"""

from __future__ import annotations

from cembench.report.content.averages import READINGS
from cembench.report.content.evidence import (
    AlgorithmSeries,
    Evidence,
)
from cembench.report.content.printed_beside_measured import (
    POLICIES,
    Quantity,
    absent_models,
    in_policy,
    policy_suffix,
    table_beside,
)
from cembench.report.document import Table
from cembench.results.columns import COLUMNS, FrameColumn


def printed_tables(evidence: Evidence, number: int) -> list[Table]:
    """Return the paper's table `number`, then other algorithms and other surfaces, if any."""
    policies = evidence.policies if evidence.paper.printed[number].by_policy else (None,)
    return [made for policy in policies for made in printed_table(evidence, number, policy)]


def printed_table(evidence: Evidence, number: int, policy: str | None) -> list[Table]:
    """Return the same under one policy, or None for a table that has none."""
    paper = evidence.paper
    table = paper.printed[number]
    tail = policy_suffix(policy, evidence) if policy else ""
    add = in_policy(evidence, policy) if policy else ""
    name, title = f"table-{number}{tail}", f"{table.title[0].upper()}{table.title[1:]}"
    shown = paper.compared if table.compares else paper.algorithms
    footers = READINGS if table.compares else ()
    disks = evidence.disk_series
    tables = []
    if evidence.models and table.figures:
        own = [q for a in shown for q in _quantities(evidence, number, evidence.series_of(a), a)]
        absent = ", ".join(absent_models(evidence))
        here = f" Here {POLICIES.get(policy, policy)}." if policy else ""
        tables.append(
            table_beside(
                evidence, name, f"Table {number}: {table.title}{add}", evidence.models, own,
                policy=policy, caption=table.caption + here, footers=footers,
                notes=(*table.notes, *(f"printed at {place}" for place in table.sources)),
                absent=f"not in this run: {absent}" if absent else "",
            )
        )  # fmt: skip
        others = [s for s in disks if not (s.algorithm in paper.algorithms and s.main)]
        if more := [q for s in others for q in _quantities(evidence, number, s)]:
            tables.append(
                table_beside(
                    evidence, f"{name}-other-algorithms",
                    f"{title}: algorithms that are not in the paper{add}",
                    evidence.models, more, policy=policy, footers=footers,
                )
            )  # fmt: skip
    if evidence.others and table.figures:
        left_out = set(paper.algorithms) - set(shown)
        series = [s for s in disks if s.algorithm not in left_out]
        tables.append(
            table_beside(
                evidence, f"{name}-other-surfaces",
                f"{title}: surfaces that are not in the paper{add}",
                evidence.others, [q for s in series for q in _quantities(evidence, number, s)],
                policy=policy, footers=footers,
            )
        )  # fmt: skip
    return tables


def _quantities(
    evidence: Evidence, number: int, series: AlgorithmSeries | None, printed: str = ""
) -> list[Quantity]:
    """Return the figures of a series; with `printed`, the algorithm's name, beside the paper's."""
    table = evidence.paper.printed[number]
    if series is not None and table.compares and series.algorithm == evidence.paper.reference:
        return []
    title = series.label if series else printed.upper()
    return [
        Quantity(
            f"{title} {one.heading}".rstrip(),
            series,
            _figure(evidence, one.column),
            (number, one.printed.format(printed)) if printed else None,
            one.digits,
        )
        for one in table.figures
        if one.only in ("", printed)
    ]


def _figure(evidence: Evidence, name: str) -> FrameColumn:
    """Return a column of the frame, or the rate of speedup of CEM over the algorithm."""
    return FrameColumn("rate", evidence.rate, form=".2f") if name == "rate" else COLUMNS[name]
