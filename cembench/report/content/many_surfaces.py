"""The section of a report on a run over many surfaces, in place of a page for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import inf
from pathlib import Path

from cembench.core.names import slug
from cembench.report.by_surface import policy_suffix
from cembench.report.content.causes import worst_table
from cembench.report.content.evidence import ANGLE, DISK, Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.content.standings import surfaces_words
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.document import (
    Gallery,
    Item,
    Section,
    Table,
    Text,
    Value,
    missing,
    words,
)
from cembench.report.given_tables import given_table
from cembench.report.plots import drawn
from cembench.results.families import votes
from cembench.results.intervals import ERROR
from cembench.results.multiple_testing import holm, sign_test

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
    evidence: Evidence, surfaces: Sequence[MeasuredSurface], inspections: Mapping[str, Inspection]
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
    evidence: Evidence, shown: Sequence[MeasuredSurface], inspections: Mapping[str, Inspection]
) -> Section:
    """Return who fails where, and the hardest surfaces with their causes and pictures."""
    table = declared_table(evidence, "who-fails-where")
    items: list[Item] = [table] if table else []
    more = (
        worst_table(evidence, shown),
        declared_table(evidence, "hardest", surfaces=shown),
        hardest_gallery(evidence, shown, inspections),
    )
    items += [item for item in more if item is not None]
    return Section("hard", "Who fails where", tuple(items))


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


#: Figures that differ by less than this share count as equal.
SAME = 1e-6


def pairwise_wins(evidence: Evidence, policy: str) -> list[Table]:
    """Return tables of angles and seconds for each target with several algorithms."""
    tables = []
    for target in evidence.contests:
        suffix = policy_suffix(policy, evidence) + f"-{slug(target)}" * (target != DISK)
        to = f", {target}" * (target != DISK)
        for figure, name, title in (
            (ANGLE, "wins-angles", "Who has the smaller angle errors"),
            ("seconds", "wins-seconds", "Who is faster"),
        ):
            tables.append(_table(evidence, name + suffix, title + to, policy, figure, target))
    return [table for table in tables if table is not None]


def _table(
    evidence: Evidence, name: str, title: str, policy: str, figure: str, target: str
) -> Table | None:
    frame = evidence.frame
    tried = frame[frame["main"] & (frame["target"] == target) & (frame["solves"] == policy)]
    if figure == "seconds":
        tried = tried[tried["external"] != "maps"]  # which have none
    series = [s for s in evidence.series_to(target) if s.label in set(tried["label"])]
    if len(series) < 2:
        return None
    cost = tried[figure].where(tried["ok"]).fillna(inf)
    table = tried.assign(cost=cost).pivot(index="place", columns="label", values="cost")
    scores = {str(label): column.tolist() for label, column in table.items()}
    pairs = list(combinations([s.label for s in series], 2))
    families = [evidence.surfaces[place].family for place in table.index]
    wins = {(a, b): votes(scores[a], scores[b], families, SAME) for a, b in pairs}
    chances = holm([sign_test(*wins[pair]) for pair in pairs])
    entries: dict[tuple[str, str], Value] = {}
    for (a, b), chance in zip(pairs, chances, strict=True):
        won, lost = wins[a, b]
        entries[a, b], entries[b, a] = _entry(won, lost, chance), _entry(lost, won, chance)
    rows = [
        (words(a.label), *(entries.get((a.label, b.label), words("")) for b in series))
        for a in series
    ]
    labels = {"algorithms": [s.label for s in series]}
    texts = {"title": title, "confidence": 100 * (1 - ERROR), "tests": _together(len(pairs))}
    return given_table("wins", rows, texts, called=name, each=labels)


def _together(pairs: int) -> str:
    if pairs == 1:
        return " (two-sided sign test)"
    return f" for all {pairs} pairs of this table together (two-sided sign tests, Holm)"


def _entry(won: int, lost: int, chance: float) -> Value:
    if not won + lost:
        return missing("no family on which they differ")
    star = " *" if chance <= ERROR else ""
    return Value(f"{won} of {won + lost}{star}", won / (won + lost), "derived")
