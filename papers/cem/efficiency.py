"""Claims about speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cembench.report.content.averages import (
    geometric_rate,
    mean_rate,
    mean_saving,
    percent,
    saving_of_mean,
)
from cembench.report.content.claims import Found, Inspections, lacking_words, under
from cembench.report.content.evidence import REFERENCE, Evidence
from cembench.results.columns import significant
from cembench.results.comparison import Comparison, compare, seconds_interval
from cembench.results.many import sign_test
from cembench.results.records import DEFAULT_ROUNDS

#: A figure agrees with the paper's if it reaches this share of it.
ABOUT = 0.9


@dataclass(frozen=True)
class _Compared:
    """An algorithm compared with CEM under one policy, on one surface for each model."""

    algorithm: str
    label: str
    #: Those with an interval.
    found: Sequence[Comparison]
    #: Number of surfaces with too few rounds for an interval.
    lacking: int

    @property
    def rates(self) -> list[float]:
        """The rates of speedup (Eq. 33)."""
        return [one.speedup for one in self.found]

    @property
    def faster(self) -> int:
        """Number of surfaces on which CEM is faster: the interval excludes equal times."""
        return sum(one.verdict == "slower" for one in self.found)

    @property
    def lacking_words(self) -> str:
        """On how many surfaces it could not be decided."""
        return lacking_words(self.lacking, len(self.found))


def _compared(evidence: Evidence) -> Iterator[_Compared]:
    """Yield each algorithm under each policy that was measured with CEM on some model."""
    for policy in evidence.policies:
        for algorithm in evidence.paper.compared:
            series = evidence.series_of(algorithm)
            records = [
                evidence.find(surface, series, policy) if series else None
                for surface in evidence.one_per_model
            ]
            pairs = [(record, evidence.base(record)) for record in records if record is not None]
            found = [compare(record, base) for record, base in pairs if base is not None]
            timed = [one for one in found if one is not None]
            sure = [one for one in timed if one.interval is not None]
            if timed:
                label = f"{algorithm.upper()}{under(policy, evidence)}"
                yield _Compared(algorithm, label, sure, len(timed) - len(sure))


def _tally(
    evidence: Evidence,
    holds: Callable[[str, list[float]], bool],
    told: Callable[[list[float]], str],
) -> Found:
    """Return what the average rates are, and for how many algorithms a claim holds."""
    found = list(_compared(evidence))
    words = [
        f"{c.label}: {told(c.rates) if c.rates else 'no average'} (n = {len(c.rates)}"
        f"{c.lacking_words})"
        for c in found
    ]
    held = sum(holds(c.algorithm, c.rates) for c in found if c.rates)
    lacking = sum(c.lacking for c in found)
    figures = "; ".join(words) or "No pair of times in this run."
    tested = sum(bool(c.rates) for c in found)
    return Found(held, tested, figures, evidence.one_per_model, lacking)


def always_faster(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM is faster than QIEM, FDM and LDM on every model."""
    found = list(_compared(evidence))
    parts = []
    for c in found:
        told = f"{c.label}: {c.faster} of {len(c.rates)}"
        if c.rates:
            p = sign_test(sum(r > 0 for r in c.rates), sum(r <= 0 for r in c.rates))
            told += f", lowest rate {min(c.rates):.2f}, sign test over surfaces p = {p:.2g}"
        parts.append(told + c.lacking_words)
    rows = [
        evidence.row(record)
        for record in evidence.records
        if record.cell.algorithm in evidence.paper.compared and record.mesh.paper_row
    ]
    sure = sum(row["verdict_corrected"] == "slower" for row in rows)
    figures = (
        f"rates surely above 0: {'; '.join(parts)}. When corrected for all comparisons of the "
        f"run (Holm), the interval excludes equality in {sure} cells."
        if parts
        else "No pair of times in this run."
    )
    return Found(
        sum(c.faster for c in found),
        sum(len(c.rates) for c in found),
        figures,
        evidence.one_per_model,
        sum(c.lacking for c in found),
        f"An interval needs {DEFAULT_ROUNDS} rounds.",
    )


def average_rates(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the average rates of speedup are 8.5 / 17.2 / 4.1."""
    return _tally(
        evidence,
        lambda algorithm, rates: (
            mean_rate(rates) >= ABOUT * evidence.paper.stated["rate"][algorithm]
        ),
        lambda rates: f"mean {mean_rate(rates):.1f}, geometric {geometric_rate(rates):.1f}",
    )


def average_savings(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM saves 89 / 94 / 80 % of the time."""
    return _tally(
        evidence,
        lambda algorithm, rates: (
            saving_of_mean(rates) >= ABOUT * evidence.paper.stated["saving"][algorithm]
        ),
        lambda rates: (
            f"{percent(saving_of_mean(rates))} of the mean rate, "
            f"{percent(mean_saving(rates))} on average"
        ),
    )


def more_than_80_percent(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM saves more than 80 % of the cost on average."""
    return _tally(
        evidence,
        lambda _, rates: mean_saving(rates) > 0.8,
        lambda rates: percent(mean_saving(rates)),
    )


def less_than_one_second(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM maps more than 100,000 triangles in less than a second."""
    series = evidence.series_of(REFERENCE)
    times: list[tuple[float, str, int, str]] = []
    lacking = 0
    for surface in evidence.surfaces if series else ():
        for policy in evidence.policies:
            record = evidence.find(surface, series, policy) if series else None
            seconds = record.outcome.median_seconds if record else None
            if record is None or seconds is None or surface.faces <= 100_000:
                continue
            if seconds_interval(record) is None:
                lacking += 1
            else:
                times.append((seconds, surface.title, surface.faces, policy))
    largest = max((t for t in times if t[0] < 1), key=lambda t: t[2], default=None)
    fits = f", the largest {largest[2]:,} triangles ({largest[1]})" if largest else ""
    smallest = min(times, key=lambda t: (t[2], t[0]), default=None)
    words = (
        f"{sum(t[0] < 1 for t in times)} of {len(times)} times below a second{fits}; the smallest "
        f"of these surfaces is {smallest[1]} with {smallest[2]:,}: {significant(smallest[0])} s"
        if smallest
        else "No time on a surface of more than 100,000 triangles in this run"
    ) + f"{lacking_words(lacking, len(times))}."
    held = int(bool(smallest and smallest[0] < 1))
    return Found(held, int(bool(times)), words, None, lacking)


def table_2_follows(evidence: Evidence, inspections: Inspections) -> Found:
    """Test whether the printed Table 2 follows from the printed Table 1."""
    agree, tested, odd = 0, 0, []
    paper = evidence.paper
    for model, times in paper.tables[1].items():
        for algorithm in evidence.paper.compared:
            other, ours = times[algorithm], times[REFERENCE]
            printed = paper.tables[2][model][algorithm]
            if other is None or ours is None or printed is None:
                continue
            tested += 1
            low, high = (other - 0.005) / (ours + 0.005), (other + 0.005) / (ours - 0.005)
            if low - 1.005 <= printed <= high - 0.995:
                agree += 1
            else:
                odd.append(
                    f"{model} / {algorithm.upper()}: {printed}, by Table 1 {other / ours - 1:.2f}"
                )
    spread = float(np.mean([r["fdm"] or 0 for r in paper.tables[2].values() if r["fdm"]]))
    figures = (
        f"{agree} of {tested} cells agree; not: {'; '.join(odd) or 'none'}. With the misprint the "
        f"mean over FDM would be {spread:.2f}."
    )
    return Found(agree, tested, figures)
