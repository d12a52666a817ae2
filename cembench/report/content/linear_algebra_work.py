"""Table of the factorisations and solves of a map, which do not depend on the machine."""

from __future__ import annotations

from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.content.printed_beside_measured import (
    POLICIES,
    Footer,
    Quantity,
    geometric_mean,
    table_beside,
)
from cembench.report.document import Table
from cembench.results.columns import COLUMNS, counted
from cembench.results.records import LinearAlgebraWork

CAPTION = (
    "Counted in the checked call by the linear algebra that all algorithms share: numeric "
    "factorisations of sparse matrices, real right-hand sides solved (a complex one counts as two, "
    "and a solve counts as the share of the factor's two triangles that it passes), and millions "
    "of nonzeros in the largest factor. "
    "Other work of an algorithm, including dense factorisations, is not counted."
)

_OWN_ORDER = (
    "own order of work (solves that pass a part of the factor, and the boundary's neighbours "
    "eliminated last)"
)


#: The counts of each algorithm; the first two have ratios to CEM's.
_COUNTS = ("counted_factorisations", "counted_columns", "factor_millions")


def work_tables(evidence: Evidence) -> list[Table]:
    """Return a table for each policy whose records hold counts."""
    known = {r.cell.solves for r in evidence.records if counted(r)}
    return [_table(evidence, policy) for policy in evidence.policies if policy in known]


def work_of(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> LinearAlgebraWork | None:
    """Return the linear algebra of an algorithm on a surface; None if unknown."""
    record = evidence.find(surface, series, policy)
    return counted(record) if record else None


def _table(evidence: Evidence, policy: str) -> Table:
    reference = evidence.series_of(evidence.reference)
    notes = [own_order(evidence)] if policy == "reuse" and reference else []
    if evidence.series_of("qiem"):
        notes.append(
            "QIEM's steps, and with them its factorisations, follow from rules for the time step "
            "and the stop that the paper leaves open and this suite decides (docs/algorithms.md)"
        )
    columns = [COLUMNS[name] for name in _COUNTS]
    ratios = Footer(
        f"over {evidence.reference.upper()}, geometric mean",
        geometric_mean,
        lambda mean: f"{mean:.2f}",
        tuple(column.heading for column in columns[:2]),
        reference.label if reference else evidence.reference,
    )
    return table_beside(
        evidence,
        f"linear-algebra-work-{policy}",
        "Factorisations and solves of a map, compared with those of CEM",
        evidence.surfaces,
        [
            Quantity(series.label, series, column, title=column.heading)
            for series in evidence.series
            for column in columns
        ],
        policy=policy,
        caption=f"{CAPTION} Here {POLICIES.get(policy, policy)}.",
        footers=(ratios,),
        notes=notes,
    )


def own_order(evidence: Evidence) -> str:
    """Return a sentence on how much of CEM's lead is its order of work beside factorisations.

    Under "backslash" CEM is Algorithm 1 as printed, with whole solves. So records of both policies
    tell; those of one do not.
    """
    frame = evidence.frame
    own = frame[frame["reference"] & frame["main"] & frame["ok"]]
    names = ["counted_factorisations", "counted_columns", "seconds"]
    under = {policy: rows.set_index("place")[names] for policy, rows in own.groupby("solves")}
    ratios = under["reuse"] / under["backslash"] if len(under) > 1 else own[names].iloc[:0]
    factored, solved, seconds = (ratios.dropna()[name].tolist() for name in names)
    if not solved:
        return (
            f"How much of CEM's lead is its {_OWN_ORDER} only a run with both policies tells: "
            "--solves reuse,backslash"
        )
    return (
        f"CEM's {_OWN_ORDER} leaves it {_percent(solved)} of the right-hand sides of Algorithm 1 "
        f"as printed, which 'backslash' runs, and reuse {_percent(factored)} of the "
        f"factorisations; together they take {_percent(seconds)} of the seconds; by that factor "
        f"its lead is not the printed algorithm's (geometric means, n = {len(solved)})"
    )


def _percent(ratios: list[float]) -> str:
    return f"{100 * geometric_mean(ratios):.0f} %"
