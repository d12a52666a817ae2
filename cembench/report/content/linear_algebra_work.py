"""Table of the factorisations and solves of a map, which do not depend on the machine."""

from __future__ import annotations

from math import exp, log

from cembench.report.content.both_policies import BOTH, seconds_under
from cembench.report.content.evidence import REFERENCE, AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.content.printed_beside_measured import POLICIES
from cembench.report.document import Column, Table, Value, count, missing, words
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
                Value(
                    f"{round(work.right_hand_sides, 1):g}", work.right_hand_sides, surface.origin
                ),
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
    notes = [own_order(evidence)] if policy == "reuse" and reference else []
    if evidence.series_of("qiem"):
        notes.append(
            "QIEM's steps, and with them its factorisations, follow from rules for the time step "
            "and the stop that the paper leaves open and this suite decides (docs/algorithms.md)"
        )
    return Table(
        f"linear-algebra-work-{policy}",
        "Factorisations and solves of a map, compared with those of CEM",
        tuple(columns),
        (*rows, tuple(means), tuple(counts)),
        f"{CAPTION} Here {POLICIES.get(policy, policy)}.",
        notes=tuple(notes),
        footer_rows=2,
    )


def own_order(evidence: Evidence) -> str:
    """Return a sentence on how much of CEM's lead is its order of work beside factorisations.

    Under "backslash" CEM is Algorithm 1 as printed, with whole solves. So records of both policies
    tell; those of one do not.
    """
    reference = evidence.series_of(REFERENCE)
    factored, solved, seconds = [], [], []
    for surface in evidence.surfaces if reference else ():
        assert reference is not None
        kept, anew = (work_of(evidence, surface, reference, p) for p in BOTH)
        times = [seconds_under(evidence, surface, reference, p)[1] for p in BOTH]
        if kept and anew and kept.right_hand_sides and anew.right_hand_sides and all(times):
            factored.append(kept.numeric / anew.numeric)
            solved.append(kept.right_hand_sides / anew.right_hand_sides)
            seconds.append((times[0] or 0.0) / (times[1] or 1.0))
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
    return f"{100 * exp(sum(map(log, ratios)) / len(ratios)):.0f} %"


def _mean(ratios: list[float]) -> Value:
    if not ratios:
        return missing("nothing to compare")
    mean = exp(sum(map(log, ratios)) / len(ratios))
    return Value(f"{mean:.2f}", mean, "derived")
