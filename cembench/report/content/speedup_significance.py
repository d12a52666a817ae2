"""Statistical certainty of the speedups: singly, together, and over surfaces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import islice
from math import exp, log
from statistics import mean

from cembench.report.by_surface import in_policy, policy_suffix
from cembench.report.content.evidence import AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.document import Column, Table, Value, count, missing, words
from cembench.results.comparison import NOT_DETECTED, Comparison, compare, paired_ratios
from cembench.results.families import FEWEST_FAMILIES, average_interval, family_means, votes
from cembench.results.multiple_testing import corrected, sign_test

CAPTION = (
    "'One by one': the number of surfaces on which the 95 % interval of the ratio within rounds "
    "excludes 1. 'Together': the number when all of the {n} verdicts of this table must be right "
    "with 95 % (Holm). 'Over families', the objects that surfaces show: whether {cem} wins on most "
    "surfaces of more families than by chance (two-sided sign test), and the geometric mean of "
    "t / t_{cem} with Student's 95 % interval, for other families like these. "
    f"{NOT_DETECTED}"
)
_ONCE = " Each model counts once, and is preferred over its stand-in."


#: The comparisons of an algorithm with the reference, and the rounds' ratios, of each surface, and
#: its family.
_Compared = list[tuple[Comparison, list[float], str]]


def sure_speedups(evidence: Evidence, policy: str) -> list[Table]:
    """Return tables on the certainty of the speedups; empty without comparable rounds."""
    surfaces = (*evidence.one_per_model, *evidence.others)
    compared = {
        series.label: found
        for series in evidence.disk_series
        if series.main and series.algorithm != evidence.reference
        if (found := paired_rounds(evidence, series, policy, surfaces))
    }
    if not compared:
        return []
    together = corrected([one for found in compared.values() for one, *_ in found])
    number, cem, left = len(together), evidence.reference.upper(), iter(together)
    verdicts = (f"{cem} faster", f"{cem} slower", "undecided")
    columns = (
        Column("algorithm", numeric=False),
        Column("surfaces"),
        *(Column(name, "one by one") for name in verdicts),
        *(Column(name, "together") for name in verdicts),
        *(Column(name, "over families") for name in ("wins", "sign test", "mean", "95 % interval")),
    )
    return [
        Table(
            name=f"sure-speedups{policy_suffix(policy, evidence)}",
            title=f"Certainty of the speedups{in_policy(evidence, policy)}",
            columns=columns,
            rows=tuple(
                _row(label, found, list(islice(left, len(found))))
                for label, found in compared.items()
            ),
            caption=CAPTION.format(n=number, cem=cem) + _ONCE * bool(evidence.stand_ins_left_out),
        )
    ]


def paired_rounds(
    evidence: Evidence,
    series: AlgorithmSeries,
    policy: str,
    surfaces: Sequence[MeasuredSurface],
) -> _Compared:
    """Return the comparison with the reference and the rounds' ratios on surfaces with both."""
    found = []
    for surface in surfaces:
        record = evidence.find(surface, series, policy)
        base = evidence.base(record) if record is not None else None
        one = compare(record, base) if record is not None and base is not None else None
        if record is not None and base is not None and one is not None and one.rounds:
            found.append((one, paired_ratios(record, base), surface.family))
    return found


def _row(label: str, compared: _Compared, together: Sequence[Comparison]) -> tuple[Value, ...]:
    figures, families = [one.ratio for one, *_ in compared], [family for *_, family in compared]
    wins, losses = votes([1.0] * len(figures), figures, families)
    p = sign_test(wins, losses)
    average = exp(mean(family_means([log(ratio) for ratio in figures], families)))
    interval = average_interval(figures, families)
    return (
        words(label),
        count(len(figures)),
        *_verdicts([one for one, *_ in compared]),
        *_verdicts(together),
        Value(f"{wins} of {wins + losses}", wins, "derived"),
        Value(f"p = {p:.2g}", p, "derived"),
        Value(f"{average:.2f}", average, "derived"),
        missing(f"fewer than {FEWEST_FAMILIES} families")
        if interval is None
        else Value(f"{interval.low:.2f} to {interval.high:.2f}", None, "derived"),
    )


def _verdicts(found: Sequence[Comparison]) -> list[Value]:
    """Return the numbers of surfaces on which the reference is faster, slower, or undecided."""
    counts = Counter(one.verdict for one in found)
    faster, slower = counts["slower"], counts["faster"]  # the verdict is about the other algorithm
    return [count(faster), count(slower), count(len(found) - faster - slower)]
