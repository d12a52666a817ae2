"""The hardest surfaces of a run, and their best maps."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from cembench.report.content.difficulty import best_record
from cembench.report.content.evidence import ANGLE, Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.document import Gallery

#: Number of surfaces shown.
HARDEST = 10


def hardest(evidence: Evidence, policy: str) -> tuple[MeasuredSurface, ...]:
    """Return the surfaces with the largest angle errors of the best map, worst first.

    Surfaces without any map come first.
    """

    def error(surface: MeasuredSurface) -> float:
        best = best_record(evidence, surface, policy)
        found = None if best is None else best.outcome.metrics.get(ANGLE)
        return inf if found is None else float(found)

    return tuple(sorted(evidence.surfaces, key=error, reverse=True)[:HARDEST])


def hardest_gallery(
    evidence: Evidence,
    policy: str,
    surfaces: tuple[MeasuredSurface, ...],
    inspections: Mapping[str, Inspection],
) -> Gallery | None:
    """Return the best map of each of these surfaces; None if the run saved no surface."""
    figures = []
    for surface in surfaces:
        seen = inspections.get(surface.mesh_hash)
        best = best_record(evidence, surface, policy)
        labels = [s.label for s in evidence.series if best and evidence.find(surface, s) is best]
        drawn = [seen.checkerboards[name] for name in labels if seen and name in seen.checkerboards]
        figures += drawn[:1]
    if not figures:
        return None
    return Gallery(
        "hardest-maps",
        "The hardest surfaces, each with its best map",
        tuple(figures),
        "The surface and its image under one checkerboard; folded triangles are red.",
    )
