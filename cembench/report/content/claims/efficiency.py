"""Claims about speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cembench.report.content.averages import (
    geometric_rate,
    mean_rate,
    mean_saving,
    percent,
    saving_of_mean,
)
from cembench.report.content.claims.verdicts import (
    OURS,
    lacking_words,
    tested_on,
    timed_verdict,
    under,
    verdict_of,
)
from cembench.report.content.evidence import REFERENCE, Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_beside_measured import significant
from cembench.report.document import Claim, Verdict
from cembench.results.comparison import Comparison, compare, seconds_interval
from cembench.results.many import sign_test
from cembench.results.records import DEFAULT_ROUNDS

Inspections = Mapping[str, Inspection]
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
) -> tuple[str, Verdict]:
    """Return the figures of the average rates, and the verdict on them."""
    found = list(_compared(evidence))
    words = [
        f"{c.label}: {told(c.rates) if c.rates else 'no average'} (n = {len(c.rates)}"
        f"{c.lacking_words})"
        for c in found
    ]
    held = sum(holds(c.algorithm, c.rates) for c in found if c.rates)
    lacking = sum(c.lacking for c in found)
    verdict = timed_verdict(held, sum(bool(c.rates) for c in found), lacking)
    return "; ".join(words) or "No pair of times in this run.", verdict


def always_faster(evidence: Evidence, inspections: Inspections) -> Claim:
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
    return Claim(
        "always-faster",
        "According to Table 2, CEM algorithm always has a better efficiency than QIEM/FDM/LDM",
        "Section 5, below Eq. (33)",
        "The rate of speedup (Eq. 33) is above 0 for every model and each of the three algorithms, "
        "and so is its 95 % interval.",
        (
            f"rates surely above 0: {'; '.join(parts)}. When corrected for all comparisons of the "
            f"run (Holm), the interval excludes equality in {sure} cells."
        )
        if parts
        else "No pair of times in this run.",
        timed_verdict(
            sum(c.faster for c in found),
            sum(len(c.rates) for c in found),
            sum(c.lacking for c in found),
        ),
        f"{tested_on(evidence.one_per_model)} {OURS} An interval needs {DEFAULT_ROUNDS} rounds.",
    )


def average_rates(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that the average rates of speedup are 8.5 / 17.2 / 4.1."""
    found, verdict = _tally(
        evidence,
        lambda algorithm, rates: (
            mean_rate(rates) >= ABOUT * evidence.paper.stated["rate"][algorithm]
        ),
        lambda rates: f"mean {mean_rate(rates):.1f}, geometric {geometric_rate(rates):.1f}",
    )
    return Claim(
        "average-rates",
        "with the average rate of the speedup 8.5/17.2/4.1",
        "Section 5, below Eq. (33)",
        f"The arithmetic mean of the rates, as the paper takes it, reaches {ABOUT:.0%} of the "
        "stated value for each algorithm; the geometric mean is given too.",
        found,
        verdict,
        f"{tested_on(evidence.one_per_model)} {OURS} "
        "In print the geometric means are 6.8 / 12.4 / 3.5, "
        "and n is 20 / 18 / 20.",
    )


def average_savings(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that CEM saves 89 / 94 / 80 % of the time."""
    found, verdict = _tally(
        evidence,
        lambda algorithm, rates: (
            saving_of_mean(rates) >= ABOUT * evidence.paper.stated["saving"][algorithm]
        ),
        lambda rates: (
            f"{percent(saving_of_mean(rates))} of the mean rate, "
            f"{percent(mean_saving(rates))} on average"
        ),
    )
    return Claim(
        "average-savings",
        "CEM algorithm saves about 89%/94%/80% of the computational time of QIEM/FDM/LDM in "
        "average",
        "Section 5, below Eq. (33)",
        f"1 - 1/(1 + mean rate), as the paper takes it, reaches {ABOUT:.0%} of the stated value.",
        found,
        verdict,
        f"{tested_on(evidence.one_per_model)} {OURS} "
        "The mean of the savings on each model, which the "
        "words suggest, is 83 / 89 / 73 % in print.",
    )


def more_than_80_percent(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that CEM saves more than 80 % of the cost on average."""
    found, verdict = _tally(
        evidence,
        lambda _, rates: mean_saving(rates) > 0.8,
        lambda rates: percent(mean_saving(rates)),
    )
    return Claim(
        "more-than-80-percent",
        "saves more than 80% of computational cost on average",
        "Section 5, summary",
        "The mean over the models of 1 - t_CEM / t is above 80 % for each of the three algorithms.",
        found,
        verdict,
        f"{tested_on(evidence.one_per_model)} {OURS} "
        "By the printed times themselves this mean is 83 / "
        "89 / 73 %: for LDM it does not reach 80 %.",
    )


def less_than_one_second(evidence: Evidence, inspections: Inspections) -> Claim:
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
    return Claim(
        "less-than-one-second",
        "a conformal parameterization can be computed in less than one second for a mesh model of "
        "more than 100,000 triangular elements by CEM algorithm",
        "Section 7",
        "CEM takes less than a second on the smallest surface above 100,000 triangles ('can be'); "
        "it need not on all larger ones.",
        words,
        timed_verdict(int(bool(smallest and smallest[0] < 1)), int(bool(times)), lacking),
        f"{OURS} The head of the report describes the machine.",
    )


def table_2_follows(evidence: Evidence, inspections: Inspections) -> Claim:
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
    return Claim(
        "table-2-follows",
        "The rate of speedup of CEM algorithm with respect to QIEM, FDM, and LDM, defined by "
        "Eq. (33)",
        "Table 2",
        "Each printed rate agrees with the printed seconds to within their rounding.",
        f"{agree} of {tested} cells agree; not: {'; '.join(odd) or 'none'}. With the misprint the "
        f"mean over FDM would be {spread:.2f}.",
        verdict_of(agree, tested),
        "This concerns the printed tables only; nothing measured is used.",
    )
