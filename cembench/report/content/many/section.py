"""The section of a report on a run over many surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cembench.report.content.by_surface import hardest_table
from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.content.many import MANY
from cembench.report.content.many.pairwise_wins import pairwise_wins
from cembench.report.content.many.worst import hardest_gallery
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.document import Item, Section, Text
from cembench.report.plots import write_plot


def is_many(evidence: Evidence) -> bool:
    """Whether a run has too many surfaces for a page each."""
    return len(evidence.surfaces) > MANY


def many_section(
    evidence: Evidence,
    shown: tuple[MeasuredSurface, ...],
    inspections: Mapping[str, Inspection],
    folder: Path,
) -> Section:
    """Return success rates, profiles, pairwise wins, and the hardest surfaces, as a section."""
    policy = evidence.policies[0]
    items: list[Item] = []
    if len(evidence.policies) > 1:
        items.append(Text(f"Unless stated otherwise, the linear-algebra policy is {policy}."))
    items += [t for name in ("success", "spread") if (t := declared_table(evidence, name))]
    names = ("accuracy-profiles", "performance-profile", "errors-by-difficulty")
    plots = (declared_plot(evidence, name) for name in names)
    items += [write_plot(plot, folder) for plot in plots if plot]
    items += pairwise_wins(evidence, policy)
    items.append(hardest_table(evidence, policy, shown))
    gallery = hardest_gallery(evidence, policy, shown, inspections)
    if gallery:
        items.append(gallery)
    return Section("many", f"Over {len(evidence.surfaces)} surfaces", tuple(items))
