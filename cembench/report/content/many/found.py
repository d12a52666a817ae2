"""The findings at the head of a report on many surfaces."""

from __future__ import annotations

from math import inf

from cembench.report.content.evidence import ANGLE, Evidence, figure
from cembench.report.content.findings import field_figures, field_words
from cembench.report.content.standings import field_of, listed
from cembench.report.document import Finding, Findings
from cembench.results.outliers import outlier_lines
from cembench.results.stability import stability_words


def many_findings(evidence: Evidence) -> Findings:
    """Return who mapped everything, whose maps to the disk are the best, and suspect maps.

    All of it is under the run's first policy.
    """
    policy = evidence.policies[0]
    held = {
        s.label: [r for surface in evidence.surfaces if (r := evidence.find(surface, s, policy))]
        for s in evidence.series
        if s.main
    }
    held = {label: records for label, records in held.items() if records}
    ok = {label: sum(r.outcome.status == "ok" for r in found) for label, found in held.items()}
    cells = sum(map(len, held.values()))
    whole = [label for label, records in held.items() if ok[label] == len(records)]
    sentences = [
        f"Over {len(evidence.surfaces)} surfaces, {len(whole)} of {len(held)} algorithms have a "
        f"valid map of every one that they take{f': {listed(whole)}' if whole else ''}."
    ]
    figures = [
        Finding(f"{100 * sum(ok.values()) / cells:.1f} %", f"of {cells} cells are valid maps")
    ]
    field = field_of(evidence, policy)
    if field is not None:
        sentences += field_words(field)
        figures += field_figures(field)
    worst = _worst(evidence, policy)
    if worst:
        error, label, where = worst
        figures.append(
            Finding(f"{error:.1f}°", f"the worst mean angle error of a valid map: {label}, {where}")
        )
    sentences.append(stability_words(evidence.records))
    return Findings(
        tuple((words,) for words in sentences if words),
        tuple(outlier_lines(evidence.records)),
        figures=tuple(figures),
    )


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
