"""The section of a report on a run over many surfaces, in place of a page for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path

from cembench.report.content.by_surface import hardest_table
from cembench.report.content.causes import worst_table
from cembench.report.content.evidence import ANGLE, Evidence, MeasuredSurface
from cembench.report.content.findings import surfaces_words
from cembench.report.content.inspection import Inspection
from cembench.report.content.pairwise_wins import pairwise_wins
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.document import Gallery, Item, Section, Text
from cembench.report.plots import drawn

#: With more surfaces than this, runs are summarised instead of shown cell by cell.
MANY = 24
#: Number of surfaces shown.
HARDEST = 10


def hardest(evidence: Evidence) -> tuple[MeasuredSurface, ...]:
    """Return the surfaces with the largest angle errors of the best map, worst first.

    Surfaces without any map come first.
    """
    errors = evidence.best_maps[ANGLE].to_dict()
    by_error = sorted(evidence.surfaces, key=lambda s: errors.get(s.mesh_hash, inf), reverse=True)
    return tuple(by_error[:HARDEST])


def hardest_gallery(
    evidence: Evidence,
    surfaces: Sequence[MeasuredSurface],
    inspections: Mapping[str, Inspection],
) -> Gallery | None:
    """Return the best map of each of these surfaces; None if the run saved no surface."""
    labels = evidence.best_maps["label"].to_dict()
    best = [(inspections[s.mesh_hash].checkerboards, labels.get(s.mesh_hash)) for s in surfaces]
    figures = [maps[label] for maps, label in best if label in maps]
    if not figures:
        return None
    return Gallery(
        "hardest-maps",
        "The hardest surfaces, each with its best map",
        tuple(figures),
        "The surface and its image under one checkerboard; folded triangles are red.",
    )


def is_many(evidence: Evidence) -> bool:
    """Whether a run has too many surfaces for a page each."""
    return len(evidence.surfaces) > MANY


def hard_section(
    evidence: Evidence,
    shown: Sequence[MeasuredSurface],
    inspections: Mapping[str, Inspection],
) -> Section:
    """Return who fails where, and the hardest surfaces with their causes and pictures."""
    table = declared_table(evidence, "who-fails-where")
    items: list[Item] = [table] if table else []
    items += [worst_table(evidence, shown), hardest_table(evidence, evidence.policies[0], shown)]
    gallery = hardest_gallery(evidence, shown, inspections)
    return Section("hard", "Who fails where", (*items, *([gallery] if gallery else [])))


def many_section(evidence: Evidence, folder: Path) -> Section:
    """Return success rates, profiles and pairwise wins, as a section."""
    policy = evidence.policies[0]
    items: list[Item] = []
    if len(evidence.policies) > 1:
        items.append(Text(f"Unless stated otherwise, the linear-algebra policy is {policy}."))
    items += [t for name in ("success", "spread") if (t := declared_table(evidence, name))]
    names = ("accuracy-profiles", "performance-profile", "errors-by-difficulty")
    plots = (declared_plot(evidence, name) for name in names)
    items += drawn(plots, folder)
    items += pairwise_wins(evidence, policy)
    over = surfaces_words(len(evidence.surfaces), evidence.families)
    return Section("many", f"Over {over}", tuple(items))
