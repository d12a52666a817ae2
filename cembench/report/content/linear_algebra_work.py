"""Table of the factorisations and solves of a map, which do not depend on the machine."""

from __future__ import annotations

from math import exp, log

from cembench.report.content.evidence import REFERENCE, AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.content.printed_beside_measured import POLICIES
from cembench.report.document import Column, Table, Value, count, missing, words
from cembench.results.records import LinearAlgebraWork

CAPTION = (
    "Counted in the checked call by the linear algebra that all algorithms share: numeric "
    "factorisations of sparse matrices, real right-hand sides solved (a complex one counts as two, "
    "a forward or backward solve alone as half), and millions of nonzeros in the largest factor. "
    "Other work of an algorithm, including dense factorisations, is not counted."
)


def work_tables(evidence: Evidence) -> list[Table]:
    """Return a table for each policy whose records hold counts."""
    return [
        _table(evidence, policy)
        for policy in evidence.policies
        if any(
            work_of(evidence, surface, series, policy) is not None
            for surface in evidence.surfaces
            for series in evidence.series
        )
    ]


def work_of(
    evidence: Evidence, surface: MeasuredSurface, series: AlgorithmSeries, policy: str
) -> LinearAlgebraWork | None:
    """Return the linear algebra of an algorithm on a surface; None if unknown."""
    record = evidence.find(surface, series, policy)
    work = record.outcome.work if record else None
    return work if work is not None and work.numeric else None


def _table(evidence: Evidence, policy: str) -> Table:
    columns = [Column("surface", numeric=False)]
    for series in evidence.series:
        titles = ("factored", "solved", "factor, M")
        columns += [Column(title, series.label) for title in titles]
    reference = evidence.series_of(REFERENCE)
    ratios: dict[str, tuple[list[float], list[float]]] = {
        series.label: ([], []) for series in evidence.series
    }
    rows = []
    for surface in evidence.surfaces:
        base = work_of(evidence, surface, reference, policy) if reference else None
        cells = [words(surface.title)]
        for series in evidence.series:
            work = work_of(evidence, surface, series, policy)
            if work is None:
                cells += [missing("not counted")] * 3
                continue
            cells += [
                Value(str(work.numeric), work.numeric, surface.origin),
                Value(f"{work.right_hand_sides:g}", work.right_hand_sides, surface.origin),
                Value(f"{work.entries / 1e6:.3g}", work.entries / 1e6, surface.origin)
                if work.entries
                else missing("the library does not report it"),
            ]
            if base is not None and base.right_hand_sides and work.right_hand_sides:
                factored, solved = ratios[series.label]
                factored.append(work.numeric / base.numeric)
                solved.append(work.right_hand_sides / base.right_hand_sides)
        rows.append(tuple(cells))
    means, counts = [words(f"over {REFERENCE.upper()}, geometric mean")], [words("n, surfaces")]
    for series in evidence.series:
        factored, solved = ratios[series.label]
        means += [_mean(factored), _mean(solved), words("")]
        counts += [count(len(factored)), words(""), words("")]
    return Table(
        f"linear-algebra-work-{policy}",
        "Factorisations and solves of a map, compared with those of CEM",
        tuple(columns),
        (*rows, tuple(means), tuple(counts)),
        f"{CAPTION} Here {POLICIES.get(policy, policy)}.",
        footer_rows=2,
    )


def _mean(ratios: list[float]) -> Value:
    if not ratios:
        return missing("nothing to compare")
    mean = exp(sum(map(log, ratios)) / len(ratios))
    return Value(f"{mean:.2f}", mean, "derived")
