"""What a run over many surfaces found, in two sentences and three figures."""

from __future__ import annotations

from collections import Counter
from math import inf

from cembench.report.content.evidence import ANGLE, Evidence, figure
from cembench.report.content.many.success import records_of
from cembench.report.document import Finding, Findings
from cembench.results.stability import stability_words


def many_findings(evidence: Evidence, policy: str) -> Findings | None:
    """Say who mapped everything, and whose maps to the disk are most often the best; None: none."""
    held = {s.label: records_of(evidence, s, policy) for s in evidence.series if s.main}
    held = {label: records for label, records in held.items() if records}
    ok = {label: sum(r.outcome.status == "ok" for r in found) for label, found in held.items()}
    cells = sum(map(len, held.values()))
    if not sum(ok.values()):
        return None
    whole = [label for label, records in held.items() if ok[label] == len(records)]
    sentence = (
        f"Over {len(evidence.surfaces)} surfaces, {len(whole)} of {len(held)} algorithms have a "
        f"valid map of every one that they take{f': {_listed(whole)}' if whole else ''}."
    )
    figures = [
        Finding(f"{100 * sum(ok.values()) / cells:.1f} %", f"of {cells} cells are valid maps")
    ]
    won, tried = _best_angles(evidence, policy)
    if won:
        label, count = won.most_common(1)[0]
        sentence += (
            f" Of the maps to the disk, {label}'s have the smallest angle errors on {count} of "
            f"{tried} surfaces."
        )
        figures.append(Finding(f"{count} of {tried}", f"surfaces on which {label} is the best"))
    worst = _worst(evidence, policy)
    if worst:
        error, label, where = worst
        figures.append(
            Finding(f"{error:.1f}°", f"the worst mean angle error of a valid map: {label}, {where}")
        )
    sentence = f"{sentence} {stability_words(evidence.records)}".rstrip()
    return Findings(sentence, tuple(figures))


def _listed(names: list[str]) -> str:
    return " and ".join(", ".join(names).rsplit(", ", 1))


def _best_angles(evidence: Evidence, policy: str) -> tuple[Counter[str], int]:
    """Count on how many surfaces each disk algorithm has the smallest angle errors."""
    series = [s for s in evidence.disk_series if s.main]
    won: Counter[str] = Counter()
    tried = 0
    for surface in evidence.surfaces:
        found = {s.label: figure(evidence, surface, s, policy, ANGLE) for s in series}
        known = {label: error for label, error in found.items() if error is not None}
        if len(known) < 2 or min(known.values()) == inf:
            continue
        tried += 1
        won[min(known, key=lambda label: known[label])] += 1
    return won, tried


def _worst(evidence: Evidence, policy: str) -> tuple[float, str, str] | None:
    """Return the largest mean angle error of a valid map, of whom, and on which surface."""
    found = (
        (error, series.label, surface.title)
        for series in evidence.series
        if series.main
        for surface in evidence.surfaces
        if (error := figure(evidence, surface, series, policy, ANGLE)) is not None and error < inf
    )
    return max(found, default=None)
