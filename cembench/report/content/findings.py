"""The findings at the head of a report: one sentence and three figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from cembench.report.content.as_good import as_good
from cembench.report.content.evidence import REFERENCE, AlgorithmSeries, Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.document import Claim, Figure, Finding, Findings
from cembench.results.comparison import Comparison, compare_ratios, paired_ratios
from cembench.results.records import Record
from cembench.results.stability import stability_words


@dataclass(frozen=True)
class _Standing:
    """An algorithm that mapped every surface, with its seconds and angle errors by surface."""

    series: AlgorithmSeries
    records: tuple[Record, ...]

    @property
    def seconds(self) -> float:
        return exp(float(np.mean([log(r.outcome.median_seconds or 1.0) for r in self.records])))

    @property
    def angles(self) -> list[float]:
        return [float(r.outcome.metrics["angle_error_mean_deg"] or np.inf) for r in self.records]

    @property
    def angle(self) -> float:
        return float(np.mean(self.angles))


def findings(
    evidence: Evidence, inspections: Mapping[str, Inspection], claims: Sequence[Claim]
) -> Findings | None:
    """Return the fastest of the equally good algorithms, the best angles, and the success.

    Only maps to the disk under the run's first policy are compared, on the surfaces that all of the
    algorithms mapped. None if nothing ended ok.
    """
    standings, n = _standings(evidence)
    if not standings:
        return None
    best = min(standings, key=lambda s: s.angle)
    good = [s for s in standings if as_good(s.angles, _best_angles(standings))] or [best]
    ranked = sorted(good, key=lambda s: s.seconds)
    on = "one surface" if n == 1 else f"{n} surfaces"
    figures = []
    sentence = f"Only {best.series.label} mapped {on}: there is nothing to compare it with."
    if len(ranked) > 1:
        first, second = ranked[:2]
        compared = _compared(second, first)
        if compared is not None:
            figures.append(_times(first, second, compared))
        sure = compared is not None and compared.verdict == "slower"
        names = f"{first.series.label} and {second.series.label}"
        fastest = (
            f"{first.series.label} is the fastest"
            if sure
            else f"{names} are the fastest (these rounds do not show which of the two)"
        )
        rest = len(standings) - len(good)
        less = f" ({rest} with larger angle errors left out)" if rest else ""
        sentence = f"On {on}, of {len(good)} algorithms with equally good angles{less}, {fastest}"
        sentence += f"; {best.series.label} has the smallest angle errors."
    elif len(standings) > 1:
        sentence = (
            f"On {on}, {best.series.label} has the smallest angle errors, and no other algorithm "
            "comes close."
        )
    figures.append(
        Finding(
            f"{best.angle:.2f}°",
            f"mean angle error of {best.series.label}, the smallest of {len(standings)}",
        )
    )
    figures.append(_holding(claims) if claims else _ended(evidence))
    sentence = f"{sentence} {stability_words(evidence.records)}"
    return Findings(sentence, tuple(figures), _picture(evidence, inspections, best.series.label))


def _best_angles(standings: Sequence[_Standing]) -> list[float]:
    return [min(column) for column in zip(*(s.angles for s in standings), strict=True)]


def _standings(evidence: Evidence) -> tuple[list[_Standing], int]:
    """Return the main series that mapped the surfaces that most mapped, and their number."""
    policy = evidence.policies[0]
    held: dict[str, dict[str, Record]] = {}
    for series in evidence.disk_series:
        if not series.main:
            continue
        for surface in evidence.surfaces:
            record = evidence.find(surface, series, policy)
            if record is not None and _has_figures(record):
                held.setdefault(series.label, {})[surface.mesh_hash] = record
    if not held:
        return [], 0
    most = max(len(records) for records in held.values())
    full = {label: records for label, records in held.items() if len(records) == most}
    common = set.intersection(*(set(records) for records in full.values()))
    order = [s.mesh_hash for s in evidence.surfaces if s.mesh_hash in common]
    named = {series.label: series for series in evidence.disk_series}
    if not order:
        return [], 0
    return [
        _Standing(named[label], tuple(records[key] for key in order))
        for label, records in full.items()
    ], len(order)


def _has_figures(record: Record) -> bool:
    outcome = record.outcome
    known = outcome.metrics.get("angle_error_mean_deg") is not None
    return outcome.status == "ok" and bool(outcome.median_seconds) and known


def _compared(slower: _Standing, faster: _Standing) -> Comparison | None:
    """Compare two algorithms by the geometric mean over surfaces of the ratios in each round."""
    ratios = [paired_ratios(a, b) for a, b in zip(slower.records, faster.records, strict=True)]
    rounds = min(map(len, ratios))
    if not rounds:
        return None
    together = np.log([found[:rounds] for found in ratios]).mean(axis=0)
    return compare_ratios(np.exp(together).tolist())


def _times(first: _Standing, second: _Standing, compared: Comparison) -> Finding:
    interval = compared.interval
    told = (
        f"95 % interval {interval.low:.2f} to {interval.high:.2f}"
        if interval
        else f"{compared.rounds} round{'s' if compared.rounds > 1 else ''}: too few for an interval"
    )
    return Finding(
        f"{compared.ratio:.2f} times",
        f"the speed of {second.series.label}, the next fastest, is reached by "
        f"{first.series.label}; {told}",
    )


def _holding(claims: Sequence[Claim]) -> Finding:
    counts = Counter(claim.verdict for claim in claims)
    tested = len(claims) - counts["not tested here"] - counts["too few rounds"]
    partly = f"; {counts['holds in part']} in part" if counts["holds in part"] else ""
    few = f"; {counts['too few rounds']} have too few rounds" if counts["too few rounds"] else ""
    return Finding(
        f"{counts['holds']} of {tested}", f"tested claims of the paper hold{partly}{few}"
    )


def _ended(evidence: Evidence) -> Finding:
    ok = sum(record.outcome.status == "ok" for record in evidence.records)
    return Finding(f"{ok} of {len(evidence.records)}", "cells ended with a valid map")


def _picture(
    evidence: Evidence, inspections: Mapping[str, Inspection], label: str
) -> Figure | None:
    """Return a picture by the algorithm with the best angles, of the largest surface with one."""
    reference = evidence.series_of(REFERENCE)
    for wanted in (label, reference.label if reference else label):
        for surface in sorted(evidence.surfaces, key=lambda s: -s.faces):
            found = inspections.get(surface.mesh_hash)
            if found and wanted in found.checkerboards:
                return found.checkerboards[wanted]
    return None
